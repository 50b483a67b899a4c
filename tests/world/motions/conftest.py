"""What the tests of world/motions share."""

import numpy as np
import pytest

from tests.support.world.objects_in_clips import a_carry
from world.motions import load
from world.motions.clip import Clip
from world.motions.synthetic.lies import lying


@pytest.fixture(scope="session")
def sitting() -> Clip:
    return next(clip for clip in load.own_clips() if clip.seat is not None)


@pytest.fixture(scope="session")
def carried() -> Clip:
    return a_carry()


@pytest.fixture(scope="session")
def lain() -> Clip:
    return lying(np.random.default_rng(3), 0.45, 1.5, 0.4, -1, head_left=True)

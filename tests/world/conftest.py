"""What the tests of world share."""

import numpy as np
import pytest

from tests.support import foreign_motions
from world.motions.clip import Clip
from world.motions.retarget import convert
from world.motions.synthetic import library


@pytest.fixture(scope="session")
def walking() -> Clip:
    return library.walking(np.random.default_rng(0), 1.2).part(20, 80)


@pytest.fixture(scope="session")
def imported(walking: Clip) -> Clip:
    return convert.retargeted(foreign_motions.recorded(walking))

"""What the tests of world/motions/formats share."""

import numpy as np
import pytest

from world.motions.clip import Clip
from world.motions.synthetic import library


@pytest.fixture(scope="session")
def walking() -> Clip:
    return library.walking(np.random.default_rng(0), 1.2).part(30, 60)

"""What the tests of world/motions/synthetic share."""

import pytest

from tests.support.world.synthetic import Posed, posed
from world.motions import load
from world.motions.clip import Seat


@pytest.fixture(scope="session")
def every() -> list[Posed]:
    """All clips of the set; all tests of this process share their making."""
    return [posed(clip) for clip in load.own_clips()]


@pytest.fixture(scope="session")
def sits(every: list[Posed]) -> list[tuple[Posed, Seat]]:
    """Those that sit down, with their seats."""
    return [(one, one.clip.seat) for one in every if one.clip.seat is not None]

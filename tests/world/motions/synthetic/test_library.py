"""The synthetic set: what it covers, and that a seed makes the same clip."""

import numpy as np
import pytest

from tests.support.world.synthetic import Posed
from world.motions.clip import Seat
from world.motions.synthetic import library


def test_the_set_covers_its_categories(every: list[Posed], sits: list[tuple[Posed, Seat]]) -> None:
    seconds = sum(one.clip.seconds for one in every)
    assert 20 * 60 < seconds < 27 * 60
    for kind in ("seat", "bed", "box"):
        used = [one.clip for one in every if getattr(one.clip, kind) is not None]
        assert sum(clip.seconds for clip in used) > 4 * 60, kind
    heights = {seat.point_m[2] for _, seat in sits}
    assert min(heights) == pytest.approx(0.36) and max(heights) == pytest.approx(0.52)
    assert len(heights) >= 6


def test_the_same_seed_makes_the_same_clip() -> None:
    first, second = (
        library.sitting(np.random.default_rng(5), 0.42, 1.5, -0.4, 1, back=True) for _ in range(2)
    )
    assert np.array_equal(first.root_position_m, second.root_position_m)
    assert np.array_equal(first.local_rotation, second.local_rotation)
    other = library.sitting(np.random.default_rng(6), 0.42, 1.5, -0.4, 1, back=True)
    assert other.frames != first.frames or not np.array_equal(
        other.root_position_m, first.root_position_m
    )

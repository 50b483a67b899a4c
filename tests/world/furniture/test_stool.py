"""Stools by hand: a level seat in the middle, low and high."""

import numpy as np
import pytest

from world.errors import ChoiceError
from world.furniture import stool


@pytest.mark.parametrize("base", ["legs", "plinth", "pedestal", "sled", "panels", "braced"])
def test_one_sits_in_the_middle_of_a_level_seat(base: str) -> None:
    piece = stool.build(stool.Dimensions(base=base))
    low, high = piece.bounds()
    (place,) = piece.sit
    assert low[2] == pytest.approx(0.0, abs=1e-9)
    assert high[2] == pytest.approx(0.42) == place.point_m[2]
    assert place.point_m[1] == pytest.approx((low[1] + high[1]) / 2)
    assert piece.size_m[1] == pytest.approx(0.40) and piece.mass_kg == 4.0


def test_drawn_stools_are_low_or_high() -> None:
    draw = np.random.default_rng(0)
    for sample, heights in ((stool.sample_low, stool.LOW), (stool.sample_high, stool.HIGH)):
        least, most = heights["seat_height_m"]
        drawn = [sample(draw, "train", turn).sit[0].point_m[2] for turn in range(30)]
        assert least <= min(drawn) < max(drawn) <= most


def test_bases_of_the_test_split_are_never_trained_on() -> None:
    assert "pedestal" not in stool.LOW_BASES["train"] and "pedestal" in stool.LOW_BASES["test"]
    assert "braced" not in stool.HIGH_BASES["train"] and "braced" in stool.HIGH_BASES["test"]
    with pytest.raises(ChoiceError, match="wheels"):
        stool.build(stool.Dimensions(base="wheels"))

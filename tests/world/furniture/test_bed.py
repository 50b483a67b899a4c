"""Beds by hand, and who lies on them."""

import math

import numpy as np
import pytest

from world.furniture import bed
from world.furniture.catalogue import find
from world.furniture.piece import HIP_TO_HEAD_M


def test_a_bed_by_hand() -> None:
    plain = bed.Dimensions(
        height_m=0.5, length_m=2.0, width_m=0.9, boards="head", board_thickness_m=0.04
    )
    piece = bed.build(plain)
    # 2.00 of mattress behind 0.04 of board: the origin is 1.02 from the board's back
    assert piece.lie is not None
    assert np.allclose(piece.lie.head_m, (-1.02 + 0.04 + 0.25, 0.0, 0.5))
    assert np.allclose(piece.lie.hip_m, (-1.02 + 0.04 + 0.25 + 0.635, 0.0, 0.5))
    # one sits on either long edge, facing out, 0.18 from it
    assert [round(math.degrees(p.facing_rad)) for p in piece.sit] == [90, -90]
    assert np.allclose([p.point_m[1] for p in piece.sit], [0.27, -0.27])


def test_a_wide_bed_is_for_two() -> None:
    piece = bed.build(bed.Dimensions(width_m=1.6))
    assert piece.lie is not None
    assert piece.lie.hip_m[1] == pytest.approx(0.8 - 0.45)


def test_lying_down_does_not_grow_with_the_bed() -> None:
    piece = find("bed-train-002")
    assert piece.lie is not None
    for scale in (0.8, 1.2):
        other = piece.scaled(scale).lie
        assert other is not None
        assert np.allclose(other.head_m, scale * np.array(piece.lie.head_m))
        assert math.dist(other.hip_m[:2], other.head_m[:2]) == pytest.approx(HIP_TO_HEAD_M)
        assert other.hip_m[2] == pytest.approx(scale * piece.lie.hip_m[2])

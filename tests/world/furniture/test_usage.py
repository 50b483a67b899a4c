"""Places of use: a seat once, a bed once for each side that it can be got onto by."""

import math

import numpy as np
import pytest

from world.errors import PieceError
from world.furniture import sofa
from world.furniture.catalogue import catalogue, find
from world.furniture.usage import UsePoint, use_points


def test_a_seat_is_one_place() -> None:
    piece = find("sofa-train-000")
    (spot,) = use_points(piece, "sit")
    assert spot.point_m == spot.head_m == piece.sit[0].point_m
    with pytest.raises(PieceError, match="has no place to lie"):
        use_points(find("chair-train-000"), "lie")


def test_sides_of_a_bed_are_square_to_it_and_its_head_is_the_same() -> None:
    beds = [piece for piece in catalogue("train", 20, affordance="lie") if piece.category == "bed"]
    assert {len(use_points(bed, "lie")) for bed in beds} == {1, 2}
    for bed in beds:
        assert bed.lie is not None
        along = np.array(bed.lie.head_m[:2]) - np.array(bed.lie.hip_m[:2])
        for spot in use_points(bed, "lie"):
            facing = np.array([math.cos(spot.facing_rad), math.sin(spot.facing_rad)])
            assert along @ facing == pytest.approx(0.0, abs=1e-9)
            assert (spot.point_m, spot.head_m) == (bed.lie.hip_m, bed.lie.head_m)
            assert -math.pi <= spot.facing_rad <= math.pi


@pytest.mark.parametrize("quarters", [0, 1, 2, 3])
def test_corners_begin_behind_the_user_whichever_way_he_faces(quarters: int) -> None:
    piece = find("chair-train-000")
    spot = UsePoint(
        (0.0, 0.0, 0.4), (0.0, 0.0, 0.4), math.remainder(quarters * math.pi / 2, 2 * math.pi)
    )
    corners = spot.corners(piece)
    assert sorted(map(tuple, corners)) == sorted(map(tuple, piece.corners()))
    ahead = corners[:, :2] @ [math.cos(spot.facing_rad), math.sin(spot.facing_rad)]
    left = corners[:, :2] @ [-math.sin(spot.facing_rad), math.cos(spot.facing_rad)]
    assert ahead[:4].max() < ahead[4:].min()
    assert left[[0, 1, 4, 5]].max() < left[[2, 3, 6, 7]].min()
    assert (corners[::2, 2] < corners[1::2, 2]).all()


def test_an_l_shaped_sofa_has_front_corners_of_its_own_on_either_side() -> None:
    """Its seat is 0.55 m deep and ends in the middle of it for who lies; the chaise on the right
    is 0.6 m longer."""
    piece = sofa.build(sofa.Dimensions(arms="corner", base="plinth"))
    (spot,) = use_points(piece, "lie")
    corners = spot.corners(piece) - np.array(spot.point_m)
    front = corners[4:].reshape(2, 2, 3)
    assert front[0, :, 0] == pytest.approx([0.875, 0.875], abs=0.01)
    assert front[1, :, 0] == pytest.approx([0.275, 0.275], abs=0.01)
    # all else is the bounding box
    whole = np.array(sorted(map(tuple, piece.corners() - np.array(spot.point_m))))
    assert corners[:6] == pytest.approx(whole[:6])
    # who sits on its middle seat has the chaise on the right as well
    (seat,) = use_points(piece, "sit")
    seen = seat.corners(piece)
    assert (seen[4:6, 0] - seen[6:, 0]) == pytest.approx([0.6, 0.6], abs=0.01)

"""Seats found from geometry: on the package's own pieces, whose places are known, and turned."""

import math

import numpy as np
import pytest

from world.furniture.affordance import seats
from world.furniture.affordance.relief import HEADROOM_M, relief
from world.furniture.catalogue import find
from world.furniture.piece import Box, Piece
from world.furniture.surface import triangles

SEATS = [
    find(f"{name}-{split}-{i:03d}")
    for name in ("chair", "armchair", "low-stool", "high-stool", "sofa")
    for split, i in (("train", 1), ("train", 3), ("test", 2))
]


def turned(piece: Piece, yaw: float) -> np.ndarray:
    """The piece's triangles turned about z."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    return triangles(piece) @ np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1.0]]).T


@pytest.mark.parametrize("piece", SEATS, ids=lambda p: p.name)
def test_seats_are_where_the_piece_has_them(piece: Piece) -> None:
    place = seats.find(relief(triangles(piece)))[0]
    assert abs(math.degrees(place.facing_rad)) <= 20
    nearest = min(piece.sit, key=lambda p: math.dist(p.point_m, place.point_m))
    assert place.point_m[2] == pytest.approx(nearest.point_m[2], abs=0.02)
    assert abs(place.point_m[0] - nearest.point_m[0]) < 0.12
    inner = max(abs(p.point_m[1]) for p in piece.sit)
    assert abs(place.point_m[1]) < inner + 0.15


@pytest.mark.parametrize("yaw_deg", [90.0, 180.0])
@pytest.mark.parametrize("name", ["chair-train-001", "armchair-train-001"])
def test_a_back_tells_the_facing_however_the_mesh_is_turned(name: str, yaw_deg: float) -> None:
    piece = find(name)
    place = seats.find(relief(turned(piece, math.radians(yaw_deg))))[0]
    off = math.remainder(place.facing_rad - math.radians(yaw_deg), 2 * math.pi)
    assert abs(math.degrees(off)) <= 20
    assert place.point_m[2] == pytest.approx(piece.sit[0].point_m[2], abs=0.02)


def test_a_long_sofa_has_places_beside_one_another() -> None:
    piece = find("sofa-train-001")
    found = seats.find(relief(triangles(piece)))
    assert len(found) >= 2
    for place in found:
        assert abs(math.degrees(place.facing_rad)) <= 25
    gaps = [math.dist(a.point_m[:2], b.point_m[:2]) for i, a in enumerate(found) for b in found[:i]]
    assert min(gaps) >= seats.APART_M


def test_a_broad_arm_is_no_second_seat() -> None:
    """A sofa whose arms carry as well as its seat, 0.20 m above it."""
    parts = (
        Box((0.0, 0.0, 0.21), (0.35, 0.35, 0.21)),
        Box((-0.32, 0.0, 0.45), (0.03, 1.05, 0.45)),
        Box((0.0, 0.70, 0.31), (0.35, 0.35, 0.31)),
        Box((0.0, -0.70, 0.31), (0.35, 0.35, 0.31)),
    )
    found = seats.find(relief(triangles(Piece("sofa", "sofa", parts, (), 40.0))))
    assert [round(place.point_m[2], 2) for place in found] == [0.42]
    level = (*parts[:2], *(Box((0.0, y, 0.21), (0.35, 0.35, 0.21)) for y in (0.7, -0.7)))
    found = seats.find(relief(triangles(Piece("sofa", "sofa", level, (), 40.0))))
    assert len(found) == 3


def round_chair(opening_deg: float, yaw: float) -> np.ndarray:
    """Triangles of a round seat with posts around it but for an opening in front, turned by yaw."""
    around = np.arange(-180.0, 180.0, 9.0)
    posts = [
        Box((0.26 * math.cos(a), 0.26 * math.sin(a), 0.37), (0.02, 0.03, 0.37))
        for a in np.radians(around[abs(around) > opening_deg / 2])
    ]
    strips = np.arange(-0.22, 0.23, 0.04)
    seat = [Box((x, 0.0, 0.22), (0.02, math.sqrt(0.24**2 - x**2), 0.22)) for x in strips]
    parts = [*seat, *posts]
    pieces = [
        Piece("round", "chair", tuple(parts[i : i + 8]), (), 1.0) for i in range(0, len(parts), 8)
    ]
    return np.concatenate([turned(piece, yaw) for piece in pieces])


@pytest.mark.parametrize("opening_deg", [100.0, 130.0, 160.0])
@pytest.mark.parametrize("yaw_deg", [0.0, 45.0, 180.0])
def test_a_round_back_is_faced_away_from_its_middle(opening_deg: float, yaw_deg: float) -> None:
    """As high at the sides as behind, so that a person fits in at many directions."""
    found = seats.find(relief(round_chair(opening_deg, math.radians(yaw_deg))))
    assert len(found) == 1
    off = math.remainder(found[0].facing_rad - math.radians(yaw_deg), 2 * math.pi)
    assert abs(math.degrees(off)) <= 20
    assert math.hypot(*found[0].point_m[:2]) < 0.1


@pytest.mark.parametrize("scale", [0.8, 1.2])
def test_scale_does_not_matter(scale: float) -> None:
    piece = find("chair-train-003").scaled(scale)
    place = seats.find(relief(triangles(piece)))[0]
    assert place.point_m[2] == pytest.approx(piece.sit[0].point_m[2], abs=0.02)
    assert abs(math.degrees(place.facing_rad)) <= 20


def test_no_seat_where_there_is_no_room() -> None:
    def plate(z: float) -> np.ndarray:
        x0, x1 = -0.3, 0.3
        a, b, c, d = ([x, y, z] for x, y in ((x0, x0), (x1, x0), (x1, x1), (x0, x1)))
        return np.array([[a, b, c], [a, c, d]], dtype=np.float64)

    assert seats.find(relief(plate(0.45)))
    # too high, too low, and with a shelf where the trunk would be
    assert not seats.find(relief(plate(1.2)))
    assert not seats.find(relief(plate(0.05)))
    covered = np.concatenate((plate(0.45), plate(0.45 + 0.6 * HEADROOM_M)))
    assert all(p.point_m[2] > 0.8 for p in seats.find(relief(covered)))
    # a narrow beam carries no one
    beam = plate(0.45) * np.array([1.0, 0.2, 1.0])
    assert not seats.find(relief(beam))

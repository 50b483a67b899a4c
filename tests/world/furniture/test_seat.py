"""Seats: the place, its support, its back."""

import math

import numpy as np
import pytest

from tests.support.world.furniture import top_below
from world.furniture import seat as seats
from world.furniture.catalogue import catalogue
from world.furniture.piece import Piece, rotation

PIECES = catalogue("train") + catalogue("test")


@pytest.mark.parametrize("piece", PIECES, ids=lambda p: p.name)
def test_the_place_is_the_seat_with_support_around(piece: Piece):
    (place,) = piece.sit
    x, y, z = place.point_m
    assert place.facing_rad == 0.0
    assert abs(top_below(piece, x, y) - z) < 1e-6
    # A pelvis is about 0.3 m wide and 0.2 m deep; half as much in front still carries the thighs.
    for dx in (-0.10, 0.0, 0.13):
        for dy in (-0.12, 0.12):
            assert abs(top_below(piece, x + dx, y + dy) - z) < 0.015
    heights = {
        "chair": (0.36, 0.48),
        "armchair": (0.33, 0.46),
        "low-stool": (0.30, 0.45),
        "high-stool": (0.50, 0.68),
    }
    low, high = heights[piece.category]
    assert low <= z <= high


@pytest.mark.parametrize(
    "piece", [p for p in PIECES if "chair" in p.category], ids=lambda p: p.name
)
def test_the_back_is_behind_the_place(piece: Piece):
    x, _, z = piece.sit[0].point_m
    # March backwards until the surface is well above the seat: that is the back, leaning away.
    steps = np.arange(0.0, 0.45, 0.001)
    risen = next(s for s in steps if top_below(piece, x - s, 0.0) > z + 0.1)
    assert 0.159 <= risen <= 0.20 + 0.1 * math.tan(math.radians(15)) + 0.003
    front = next(s for s in steps if top_below(piece, x + s, 0.0) < z - 0.02)
    assert 0.38 <= risen + front <= 0.54


def test_tilt_lowers_the_seat_towards_the_back():
    seat = seats.Seat(0.45, 0.40, 0.45, 0.04, tilt_rad=math.radians(4.0))
    assert seat.surface_m(0.40) == pytest.approx(0.45)
    assert seat.surface_m(0.0) == pytest.approx(0.45 - 0.4 * math.tan(math.radians(4.0)))
    piece = Piece("seat", "seat", (seat.box(),), (), 1.0)
    for x in (0.01, 0.2, 0.39):
        assert top_below(piece, x, 0.1) == pytest.approx(seat.surface_m(x), abs=1e-9)


def test_recline_leans_the_back_away():
    seat = seats.Seat(0.45, 0.40, 0.45, 0.04)
    back = seats.backrest(seat, 0.0, 0.5, 0.4, 0.03, math.radians(15.0))
    turn = rotation(back.quat)
    front = np.array(back.centre_m) + turn @ np.array([0.015, 0.0, -0.25])
    crown = np.array(back.centre_m) + turn @ np.array([0.015, 0.0, 0.25])
    assert np.allclose(front, [0.0, 0.0, 0.45])
    assert np.allclose(
        crown - front, 0.5 * np.array([-math.sin(0.2618), 0, math.cos(0.2618)]), atol=1e-5
    )

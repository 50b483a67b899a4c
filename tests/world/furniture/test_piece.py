"""Pieces: frame, scale, padding, and what cannot be."""

import math

import numpy as np
import pytest

from world.errors import PieceError
from world.furniture.catalogue import catalogue, find
from world.furniture.piece import SLOTS, Box, Piece, SeatTarget

PIECES = catalogue("train") + catalogue("test")


@pytest.mark.parametrize("piece", PIECES, ids=lambda p: p.name)
def test_frame_slots_and_size(piece: Piece):
    low, high = piece.bounds()
    assert np.allclose(low[:2], -high[:2], atol=1e-12)
    assert abs(low[2]) < 1e-12
    assert 1 <= len(piece.boxes) <= SLOTS
    assert 0.29 < piece.size_m[0] < 1.0
    assert 0.31 < piece.size_m[1] < 0.95
    assert piece.mass_kg >= 3.0
    corners = piece.corners()
    assert corners.shape == (8, 3)
    assert np.array_equal(corners[0], low)
    assert np.allclose(corners[1], [low[0], low[1], high[2]])
    assert np.allclose(corners[7], high)


def test_scaling():
    piece = find("armchair-train-003")
    small = piece.scaled(0.8)
    assert np.allclose(small.size_m, 0.8 * np.array(piece.size_m))
    assert np.allclose(small.sit[0].point_m, 0.8 * np.array(piece.sit[0].point_m))
    assert np.allclose(small.corners(), 0.8 * piece.corners())
    assert small.mass_kg == pytest.approx(0.512 * piece.mass_kg)
    assert small.sit[0].facing_rad == piece.sit[0].facing_rad
    assert [b.quat for b in small.boxes] == [b.quat for b in piece.boxes]
    for bad in (0.0, -1.0, math.nan):
        with pytest.raises(PieceError, match="above 0"):
            piece.scaled(bad)


def test_padding_keeps_the_boxes_and_marks_the_rest():
    piece = find("high-stool-train-000")
    centre, half, quat, used = piece.boxes_padded()
    count = len(piece.boxes)
    assert centre.shape == half.shape == (SLOTS, 3)
    assert quat.shape == (SLOTS, 4)
    assert used.tolist() == [True] * count + [False] * (SLOTS - count)
    assert np.allclose(centre[:count], [b.centre_m for b in piece.boxes])
    assert np.all(half > 0.0)
    assert np.allclose(np.linalg.norm(quat, axis=1), 1.0)
    assert max(len(p.boxes) for p in PIECES) == SLOTS


def test_pieces_that_cannot_be_are_refused():
    box = Box((0.0, 0.0, 0.5), (0.5, 0.5, 0.5))
    with pytest.raises(PieceError, match="9 boxes"):
        Piece("x", "chair", (box,) * 9, (SeatTarget((0.0, 0.0, 1.0)),), 1.0)
    with pytest.raises(PieceError, match="0 boxes"):
        Piece("x", "chair", (), (), 1.0)
    with pytest.raises(PieceError, match="volume"):
        Piece("x", "chair", (Box((0.0, 0.0, 0.0), (0.1, 0.0, 0.1)),), (), 1.0)

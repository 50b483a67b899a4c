"""Places are on the surface."""

import numpy as np
import pytest

from world.furniture import table
from world.furniture.catalogue import SEATS, whole
from world.furniture.piece import HIP_TO_HEAD_M, Piece, rotation

LARGE = [p for split in ("train", "test") for p in whole(split) if p.category not in SEATS]


def inside(piece: Piece, point: tuple[float, float, float]) -> bool:
    """Whether a point lies in one of the piece's boxes."""
    for box in piece.boxes:
        local = rotation(box.quat).T @ (np.array(point) - box.centre_m)
        if (np.abs(local) <= box.half_m).all():
            return True
    return False


def on_top(piece: Piece, point: tuple[float, float, float], by_m: float = 0.012) -> bool:
    """Whether the surface runs through the point: solid just below it, free just above."""
    x, y, z = point
    return inside(piece, (x, y, z - by_m)) and not inside(piece, (x, y, z + by_m))


@pytest.mark.parametrize("piece", LARGE[::3], ids=lambda p: p.name)
def test_places_are_on_the_surface(piece: Piece) -> None:
    low, high = piece.bounds()
    assert np.allclose(low[:2], -high[:2], atol=1e-9)
    assert abs(low[2]) < 1e-9
    if piece.category == "table":
        assert not piece.sit
        long = piece.size_m[1] >= table.LONG_M and piece.size_m[0] >= table.DEEP_M
        assert (piece.lie is not None) == long
        if not long:
            return
    for place in piece.sit:
        assert on_top(piece, place.point_m)
    assert piece.lie is not None
    hip, head = np.array(piece.lie.hip_m), np.array(piece.lie.head_m)
    assert on_top(piece, piece.lie.hip_m)
    assert on_top(piece, piece.lie.head_m)
    assert np.linalg.norm((head - hip)[:2]) == pytest.approx(HIP_TO_HEAD_M)
    # the crown of the head, 0.1 m on, is still over the piece
    crown = head + 0.10 * (head - hip) / np.linalg.norm(head - hip)
    assert (crown[:2] > low[:2]).all()
    assert (crown[:2] < high[:2]).all()

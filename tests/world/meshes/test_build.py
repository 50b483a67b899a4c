"""Pieces from meshes: places are found, told, or refused."""

import numpy as np
import pytest

from tests.support.world.meshes import built
from world.errors import PieceError
from world.furniture.catalogue import find
from world.furniture.piece import Box, Piece
from world.furniture.surface import triangles
from world.meshes import decompose
from world.meshes.build import ImportOptions, located

CHAIR = find("chair-train-000")


def test_targets_are_found_or_stated() -> None:
    found = built().piece
    assert found.sit[0].point_m[2] == pytest.approx(CHAIR.sit[0].point_m[2], abs=0.02)
    told = built((0.1, 0.0, 0.5, 90.0)).piece
    assert told.sit[0].point_m == (0.1, 0.0, 0.5)
    assert told.sit[0].facing_rad == pytest.approx(np.pi / 2)


def test_places_in_which_hulls_stand_are_left_out() -> None:
    """A bench for three, whose hulls are broader than the mesh at one end: a hull spans hollows."""
    bench = (Box((0.0, 0.0, 0.43), (0.25, 0.9, 0.02)), Box((-0.24, 0.0, 0.7), (0.01, 0.9, 0.25)))
    filled = Box((0.0, 0.6, 0.55), (0.25, 0.29, 0.1))
    surface = triangles(Piece("bench", "sofa", bench, (), 20.0))

    def places(boxes: tuple[Box, ...]) -> list[float]:
        parts = tuple(h for b in boxes if (h := decompose.closed(b.corners())) is not None)
        piece, _ = located("bench", surface, parts, ImportOptions(category="sofa"))
        assert all(p.point_m[2] == pytest.approx(0.45, abs=0.01) for p in piece.sit)
        return sorted(p.point_m[1] for p in piece.sit)

    free = places(bench)
    assert len(free) == 3
    assert places((*bench, filled)) == pytest.approx(free[:2], abs=0.02)


def test_a_piece_without_a_seat_is_refused() -> None:
    spike = np.array([[[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0.9]]], dtype=np.float64)
    hull = decompose.closed(np.concatenate((spike[0], spike[0] + [0.05, 0.05, 0.0])))
    assert hull is not None
    with pytest.raises(PieceError, match=r"no place to sit on this chair .*--sit"):
        located("spike", spike, (hull,), ImportOptions(category="chair"))

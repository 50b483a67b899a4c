"""A seated ragdoll comes to rest on every seat at the height that the piece gives, at all sizes."""

import pytest

from tests.ragdoll import drop
from world.furniture.catalogue import whole
from world.furniture.piece import Piece

#: One of every construction or so; docs/furniture.md has the figures of all.
PIECES = [p for p in (*whole("train")[:49:2], *whole("test")[:28:3]) if p.sit]


@pytest.mark.parametrize("scale", [0.8, 1.0, 1.2])
@pytest.mark.parametrize("piece", PIECES, ids=lambda p: p.name)
def test_a_ragdoll_comes_to_rest_on_the_seat(piece: Piece, scale: float) -> None:
    rest = drop(piece.scaled(scale), seconds=3.0)
    assert rest.finite
    assert abs(rest.height_error_m) < 0.03
    assert rest.deepest_m < 0.015
    assert rest.speed_m_s < 0.1
    assert rest.off_m < 0.25


@pytest.mark.parametrize("piece", PIECES[::6], ids=lambda p: p.name)
def test_nothing_explodes_in_ten_seconds(piece: Piece) -> None:
    rest = drop(piece.scaled(1.2), seconds=10.0)
    assert rest.finite
    assert rest.fastest_m_s < 1.5
    assert rest.deepest_m < 0.015

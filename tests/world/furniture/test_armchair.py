"""Armchairs: arms beside the place."""

import numpy as np
import pytest

from tests.support.world.furniture import top_below
from world.furniture.catalogue import catalogue
from world.furniture.piece import Piece

PIECES = catalogue("train") + catalogue("test")


@pytest.mark.parametrize(
    "piece", [p for p in PIECES if p.category == "armchair"], ids=lambda p: p.name
)
def test_arms_are_beside_the_place(piece: Piece):
    x, _, z = piece.sit[0].point_m
    for side in (-1, 1):
        gap = next(g for g in np.arange(0.0, 0.4, 0.001) if top_below(piece, x, side * g) > z + 0.1)
        assert 0.24 <= gap <= 0.302
        assert 0.18 <= top_below(piece, x, side * (gap + 0.01)) - z <= 0.26

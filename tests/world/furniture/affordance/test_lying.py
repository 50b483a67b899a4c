"""Where one lies, found from geometry."""

import pytest

from world.furniture.affordance import lying
from world.furniture.affordance.relief import relief
from world.furniture.catalogue import find
from world.furniture.piece import Piece
from world.furniture.surface import triangles

BEDS = [find(f"bed-{split}-{i:03d}") for split, i in (("train", 0), ("train", 1), ("test", 0))]
SOFAS = [find(f"sofa-train-{i:03d}") for i in (0, 2)]


@pytest.mark.parametrize("piece", BEDS, ids=lambda p: p.name)
def test_one_lies_with_the_head_at_the_head_end(piece: Piece) -> None:
    lie = lying.find(relief(triangles(piece)))
    assert lie is not None
    assert piece.lie is not None
    assert lie.head_m[0] < lie.hip_m[0] - 0.5
    assert abs(lie.head_m[1] - lie.hip_m[1]) < 0.1
    for found, known in ((lie.hip_m, piece.lie.hip_m), (lie.head_m, piece.lie.head_m)):
        assert found[2] == pytest.approx(known[2], abs=0.02)
        assert abs(found[0] - known[0]) < 0.35


@pytest.mark.parametrize("piece", SOFAS, ids=lambda p: p.name)
def test_one_lies_along_a_sofa(piece: Piece) -> None:
    lie = lying.find(relief(triangles(piece)))
    assert lie is not None
    assert piece.lie is not None
    assert abs(lie.head_m[1] - lie.hip_m[1]) > 0.6
    assert lie.hip_m[2] == pytest.approx(piece.lie.hip_m[2], abs=0.03)


def test_a_chair_is_too_short_to_lie_on() -> None:
    assert lying.find(relief(triangles(find("armchair-train-000")))) is None

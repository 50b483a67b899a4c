"""Pieces from meshes: places are found, told, or refused."""

import numpy as np
import pytest

from tests.support.world.meshes import built
from world.errors import PieceError
from world.furniture.catalogue import find
from world.furniture.piece import Box, Piece
from world.furniture.surface import triangles
from world.meshes import decompose
from world.meshes.build import ImportOptions, located, places

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

    options = ImportOptions(category="sofa")
    found = places("bench", surface, options)

    def kept(boxes: tuple[Box, ...]) -> list[float]:
        parts = tuple(h for b in boxes if (h := decompose.closed(b.corners())) is not None)
        piece, _ = located("bench", parts, options, found)
        assert all(p.point_m[2] == pytest.approx(0.45, abs=0.01) for p in piece.sit)
        return sorted(p.point_m[1] for p in piece.sit)

    free = kept(bench)
    assert len(free) == 3
    assert kept((*bench, filled)) == pytest.approx(free[:2], abs=0.02)


def test_a_piece_without_a_seat_is_refused() -> None:
    spike = np.array([[[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0.9]]], dtype=np.float64)
    with pytest.raises(PieceError, match=r"no place to sit on this chair .*--sit"):
        places("spike", spike, ImportOptions(category="chair"))
    with pytest.raises(PieceError, match=r"no place to sit or lie and no table's top .*--up"):
        places("spike", spike, ImportOptions())


def block(centre: tuple[float, float, float], half: tuple[float, float, float]) -> np.ndarray:
    return triangles(Piece("block", "block", (Box(centre, half),), (), 1.0))


@pytest.mark.parametrize("open_below", [False, True])
@pytest.mark.parametrize("arms_m", [0.62, 0.95, 1.30])
def test_a_seat_is_on_the_cushion_and_never_inside_an_arm(arms_m: float, open_below: bool) -> None:
    """A sofa on feet of 0.14 m between block arms: above their undersides are up to 1.16 m of
    room."""
    arms = np.concatenate(
        [block((0.0, y, 0.07 + arms_m / 2), (0.45, 0.2, arms_m / 2 - 0.07)) for y in (-0.9, 0.9)]
    )
    if open_below:
        arms = arms[~(arms[..., 2] < 0.15).all(axis=1)]
    back = block((-0.40, 0.0, 0.45), (0.05, 0.7, 0.45))
    sofa = np.concatenate((block((0.0, 0.0, 0.28), (0.45, 0.7, 0.14)), back, arms))
    found = places("sofa", sofa, ImportOptions(named="sofa"))
    assert found.category == "sofa" and not found.notes
    assert found.sit
    for target in found.sit:
        assert target.point_m[2] == pytest.approx(0.42, abs=0.005)
        assert abs(target.point_m[1]) < 0.7


def test_under_a_roof_the_seat_is_below_it() -> None:
    """A bed with a canopy at 2.1 m; a chest of 0.9 m whose inside no one reaches."""
    bed = triangles(find("bed-train-000"))
    roof = block((0.0, 0.0, 2.1), (1.05, 0.85, 0.02))
    found = places("bed", np.concatenate((bed, roof)), ImportOptions(named="bed"))
    assert found.roofed and found.category == "bed" and found.lie is not None
    assert found.lie.hip_m[2] == pytest.approx(find("bed-train-000").lie.hip_m[2], abs=0.03)  # pyright: ignore[reportOptionalMemberAccess]
    chest = places("chest", block((0.0, 0.0, 0.5), (0.5, 0.9, 0.4)), ImportOptions())
    assert all(target.point_m[2] == pytest.approx(0.9) for target in chest.sit)


@pytest.mark.parametrize(
    ("name", "lies"),
    [("table-train-000", True), ("table-train-001", False)],
)
def test_tables_offer_places(name: str, lies: bool) -> None:
    """One of 0.88 x 1.80 m carries a person, one of a smaller top a seated one only."""
    piece = find(name)
    found = places(name, triangles(piece), ImportOptions(named="table"))
    assert found.category == "table"
    top = piece.size_m[2]
    assert found.sit and all(p.point_m[2] == pytest.approx(top, abs=0.01) for p in found.sit)
    assert (found.lie is not None) == lies


def test_a_sloping_seat_has_the_height_of_its_upper_part() -> None:
    """A seat that falls by 7 cm from front to back: furniture is measured at the front."""
    x = np.array([-0.3, 0.3])
    z = np.array([0.37, 0.44])
    a, b, c, d = ([x[i], y, z[i]] for i, y in ((0, -0.3), (1, -0.3), (1, 0.3), (0, 0.3)))
    slope = np.array([[a, b, c], [a, c, d]], dtype=np.float64)
    wall = block((-0.32, 0.0, 0.45), (0.02, 0.3, 0.45))
    found = places("slope", np.concatenate((slope, wall)), ImportOptions(named="chair"))
    assert 0.41 < found.sit[0].point_m[2] <= 0.44

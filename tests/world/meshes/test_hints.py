"""Units and axes that make furniture of a mesh."""

import numpy as np
import pytest

from tests.support.world.meshes import y_up
from world.errors import PieceError
from world.furniture.catalogue import find
from world.furniture.surface import triangles
from world.meshes import hints
from world.meshes.frame import METRES, Frame, Unit
from world.meshes.source import Source
from world.meshes.upright import upright


def mesh(name: str, unit: Unit, turned: bool) -> Source:
    corners = triangles(find(f"{name}-train-000")) / METRES[unit]
    corners = y_up(corners) if turned else corners
    faces = np.arange(corners.size // 3).reshape(-1, 3)
    return Source(name, corners.reshape(-1, 3), faces, ".obj")


@pytest.mark.parametrize("turned", [False, True], ids=["z-up", "y-up"])
@pytest.mark.parametrize("unit", ["cm", "mm", "in", "ft"])
@pytest.mark.parametrize("name", ["chair", "table"])
def test_the_unit_and_axis_of_the_file_are_named(name: str, unit: Unit, turned: bool) -> None:
    expected = f"--unit {unit}" + " --up +y" * turned
    assert hints.flags(mesh(name, unit, turned), Frame(), name) == expected


def test_the_refusal_names_them() -> None:
    with pytest.raises(PieceError, match=r"is no furniture; give --unit in$"):
        upright(mesh("chair", "in", turned=False), Frame())
    with pytest.raises(PieceError, match=r"is no furniture; give --unit cm --up \+y$"):
        upright(mesh("sofa", "cm", turned=True), Frame())


def test_a_stated_unit_leaves_the_axis() -> None:
    lying = mesh("chair", "cm", turned=True)
    assert hints.flags(lying, Frame(unit="cm"), "chair") == "--up +y"
    assert hints.flags(lying, Frame(height_m=0.9), "chair") == "--up +y"


@pytest.mark.parametrize(
    "name", ["chair", "armchair", "low-stool", "high-stool", "sofa", "bed", "table"]
)
def test_the_package_s_own_pieces_are_ordinary(name: str) -> None:
    for number in (0, 1):
        assert hints.unlikeness(triangles(find(f"{name}-train-{number:03d}"))) < hints.ODD


def test_an_odd_piece_is_refused_unless_size_and_axis_are_stated() -> None:
    """A chair in feet with y up fits into a room as it stands, 2.9 m broad."""
    odd = mesh("chair", "ft", turned=True)
    corners = upright(odd, Frame())
    with pytest.raises(PieceError, match=r"is odd, and with --unit ft --up \+y it is ordinary"):
        hints.require_ordinary(odd, Frame(), corners, "chair")
    hints.require_ordinary(odd, Frame(unit="m", up="+z"), corners, "chair")
    own = mesh("chair", "m", turned=False)
    hints.require_ordinary(own, Frame(), upright(own, Frame()), "table")

"""Ground planes below pieces."""

import itertools

import numpy as np
import pytest

from tests.support.world.meshes import TRIANGLES
from world.furniture.catalogue import find
from world.furniture.piece import Box, Piece
from world.furniture.surface import triangles
from world.meshes import ground
from world.meshes.frame import Frame
from world.meshes.source import Source
from world.meshes.upright import placed


def square(half_m: float, z: float = 0.0, parts: int = 1) -> np.ndarray:
    """A horizontal square of parts x parts tiles."""
    edges = np.linspace(-half_m, half_m, parts + 1)
    tiles = []
    for x0, x1 in itertools.pairwise(edges):
        for y0, y1 in itertools.pairwise(edges):
            a, b, c, d = ([x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z])
            tiles += [[a, b, c], [a, c, d]]
    return np.array(tiles)


def slab(half_m: float, thick_m: float) -> np.ndarray:
    box = Box((0.0, 0.0, thick_m / 2), (half_m, half_m, thick_m / 2))
    return triangles(Piece("slab", "slab", (box,), (), 1.0))


@pytest.mark.parametrize(
    ("below", "raised_m"),
    [
        (square(2.0), 0.0),
        (square(2.0, parts=6), 0.0),
        (square(0.4), 0.0),  # little larger than the chair
        (square(3.0, z=-0.1), 0.0),
        (square(5.0) + np.array([3.0, 2.0, 0.0]), 0.0),
        (slab(1.5, 0.03), 0.03),
    ],
    ids=["plane", "tiles", "small", "below", "aside", "slab"],
)
@pytest.mark.parametrize("unit", [1.0, 100.0])
def test_a_ground_is_found_in_any_unit(below: np.ndarray, raised_m: float, unit: float) -> None:
    both = unit * np.concatenate((TRIANGLES + np.array([0.0, 0.0, raised_m]), below))
    found = ground.plane(both)
    assert found is not None
    assert found[len(TRIANGLES) :].all()
    assert not found[: len(TRIANGLES)].any()


@pytest.mark.parametrize(
    "name", ["chair-train-000", "bed-train-001", "sofa-train-000", "table-train-002"]
)
def test_a_piece_alone_has_none(name: str) -> None:
    assert ground.plane(triangles(find(name))) is None


def test_it_is_left_out_and_said() -> None:
    corners = np.concatenate((TRIANGLES, square(2.0)))
    mesh = Source(
        "chair", corners.reshape(-1, 3), np.arange(corners.size // 3).reshape(-1, 3), ".obj"
    )
    found, notes = placed(mesh, Frame())
    assert np.allclose(found, TRIANGLES, atol=1e-6)
    assert notes == ("a ground plane of 4.00 x 4.00 m is left out",)

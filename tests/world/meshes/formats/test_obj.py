"""OBJ geometry as exporters write it."""

import numpy as np
import pytest

from world.errors import PieceError
from world.meshes.formats import obj

VERTICES = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def lines(*faces: str, gap: str = " ", end: str = "\n") -> bytes:
    rows = [gap.join(("v", *map(str, v))) for v in VERTICES]
    return (end.join([*rows, *faces]) + end).encode()


@pytest.mark.parametrize(
    "content",
    [
        lines("f 1 2 3 4"),
        lines("f\t1 2\t3  4", gap="\t"),
        lines("f 1/1/1 2/2/2 3/3/3 4/4/4", end="\r\n"),
        lines("f 1//1 2//1 3//1 4//1", end="\r"),
        lines("f -4 -3 -2 -1"),
        lines("f -4//-1 -3//-1 -2//-1 -1//-1 # a comment"),
        lines("f 1 2 \\", "3 4"),
        lines("f 1 2\\", " 3 4"),
        b"\xef\xbb\xbf" + lines("f 1 2 3 4"),
        lines("f 1 2 3 4").decode().encode("utf-16"),
        lines("vn 0 0 1", "vt 0 0", "l 1 2", "usemtl a b", "f 1 2 3 4"),
        lines("f 1 2 3 4").replace(b"1 1 0", b"1 1 0 .5 .5 1"),
    ],
)
def test_a_square_is_two_triangles(content: bytes) -> None:
    vertices, triangles = obj.read(content, "square.obj")
    assert vertices.tolist() == VERTICES
    assert triangles.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_relative_indices_count_back_from_the_face() -> None:
    """Two parts, each with its own vertices: the same indices name others."""
    part = lines("f -4 -3 -2")
    vertices, triangles = obj.read(part + part, "parts.obj")
    assert len(vertices) == 8
    assert triangles.tolist() == [[0, 1, 2], [4, 5, 6]]


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (lines("f 1 2 x"), "line 5: not a face: f 1 2 x"),
        (lines("f 0 1 2"), "line 5: not a face"),
        (lines("f -5 -1 -2"), "line 5: not a face"),
        (b"v 0 0\nv 1 0 0\nf 1 2 1\n", "line 1: not a vertex: v 0 0"),
        (b"v 0,5 0 0\nf 1 1 1\n", "line 1: not a vertex: v 0,5 0 0"),
        (b"v 0 0 0\nsurf 0 1 0 1 1\n", "curved surfaces without polygons"),
    ],
)
def test_what_is_no_geometry_names_its_line(content: bytes, says: str) -> None:
    with pytest.raises(PieceError, match=f"bad.obj: {says}"):
        obj.read(content, "bad.obj")


def test_without_faces_there_are_no_triangles() -> None:
    vertices, triangles = obj.read(b"v 0 0 0\n", "points.obj")
    assert vertices.shape == (1, 3) and triangles.shape == (0, 3)
    assert triangles.dtype == np.int64

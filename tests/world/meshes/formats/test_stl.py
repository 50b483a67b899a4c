"""STL as scanners and printers write it."""

import struct

import numpy as np
import pytest

from tests.support.world.meshes import TRIANGLES, mesh
from world.errors import PieceError
from world.meshes.formats import stl

BINARY: bytes = mesh().export(file_type="stl")  # pyright: ignore[reportAssignmentType]
TEXT: str = mesh().export(file_type="stl_ascii")  # pyright: ignore[reportAssignmentType]
COUNT = len(TRIANGLES)


def with_count(count: int) -> bytes:
    return BINARY[:80] + struct.pack("<I", count) + BINARY[84:]


@pytest.mark.parametrize(
    "content",
    [
        BINARY,
        BINARY + b"x",
        BINARY + bytes(37),
        BINARY + bytes(5000),
        b"solid facet chair".ljust(80, b"\0") + BINARY[80:],
        b"solid facet chair".ljust(80, b" ") + BINARY[80:] + b"tail",
        with_count(0),
        with_count(0xFFFFFFFF),
        TEXT.encode(),
        TEXT.upper().encode(),
        TEXT.replace("\n", "\r\n").replace("vertex ", "  vertex\t").encode() + b"\n<eof>",
    ],
)
def test_the_triangles_are_read(content: bytes) -> None:
    vertices, triangles = stl.read(content, "chair.stl")
    assert np.allclose(vertices[triangles], TRIANGLES, atol=1e-5)
    assert stl.announced(content) == COUNT


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (BINARY[:-70], f"states {COUNT} triangles and holds {COUNT - 2}; is it cut short"),
        (b"solid a\nfacet\nvertex 0 0 0\nvertex 1 0 x\nvertex 0 1 0\n", "not three numbers"),
        (b"solid a\nfacet\nvertex 0 0 0\nvertex 1 0 0\n", "2 corners, no multiple of 3"),
    ],
)
def test_what_is_cut_is_refused(content: bytes, says: str) -> None:
    with pytest.raises(PieceError, match=f"bad.stl: .*{says}"):
        stl.read(content, "bad.stl")


def test_nothing_is_no_triangles() -> None:
    for content in (b"", b"solid x\nendsolid x\n", bytes(84)):
        _, triangles = stl.read(content, "empty.stl")
        assert triangles.shape == (0, 3)

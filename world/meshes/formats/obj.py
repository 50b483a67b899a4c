"""Reader of the geometry of Wavefront OBJ files.

trimesh resolves relative indices within an object instead of within the file, and splits fields at
spaces only.
"""

import codecs
import itertools
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from world.errors import PieceError

_FREE_FORM = (b"surf", b"curv", b"curv2")


def read(content: bytes, file_name: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices [n, 3] and triangles [m, 3]; polygons are cut into fans. Raises PieceError."""
    vertices: list[list[bytes]] = []
    triangles: list[tuple[int, int, int]] = []
    free_form = False
    for number, words in _statements(content):
        if words[0] == b"v":
            vertices.append(words[1:4])
        elif words[0] in (b"f", b"fo"):  # `fo`: the former name of `f`
            try:
                corners = [_index(word, len(vertices)) for word in words[1:]]
            except ValueError:
                raise PieceError(
                    f"{file_name}: line {number}: not a face: {_shown(words)}"
                ) from None
            triangles.extend((corners[0], b, c) for b, c in itertools.pairwise(corners[1:]))
        free_form = free_form or words[0] in _FREE_FORM
    if free_form and not triangles:
        raise PieceError(f"{file_name}: curved surfaces without polygons; export polygons")
    try:
        points = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    except ValueError:
        raise PieceError(f"{file_name}: {_wrong_vertex(content)}") from None
    return points, np.array(triangles, dtype=np.int64).reshape(-1, 3)


def _statements(content: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """Line numbers and words, without comments; a backslash continues a line."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        content = content.decode("utf-16", "replace").encode()
    pending: list[bytes] = []
    for number, line in enumerate(content.removeprefix(codecs.BOM_UTF8).splitlines(), 1):
        words = line.partition(b"#")[0].split()
        if words and words[-1].endswith(b"\\"):
            last = words.pop()[:-1]
            pending += [*words, *([last] if last else [])]
            continue
        words, pending = pending + words, []
        if words:
            yield number, words


def _index(word: bytes, count: int) -> int:
    """The vertex of `v`, `v/vt`, `v//vn` or `v/vt/vn`, from 0; a negative one counts back from the
    last vertex before the face. Raises ValueError."""
    index = int(word.partition(b"/")[0])
    if index == 0 or index < -count:
        raise ValueError
    return index - 1 if index > 0 else count + index


def _wrong_vertex(content: bytes) -> str:
    """Where the first vertex is that has not three numbers."""
    for number, words in _statements(content):
        if words[0] == b"v":
            try:
                np.array(words[1:4], dtype=np.float64).reshape(3)
            except ValueError:
                return f"line {number}: not a vertex: {_shown(words)}"
    return "vertices that are no numbers"


def _shown(words: list[bytes]) -> str:
    return b" ".join(words)[:60].decode("utf-8", "replace")

"""Reader of STL files, binary and ASCII, with bytes behind the triangles and wrong counts."""

import re
import struct

import numpy as np
from numpy.typing import NDArray

from world.errors import PieceError

_HEADER, _FACET = 84, 50
"""Bytes of the header with its count, and of a triangle."""
_STREAMED = (0, 0xFFFFFFFF)
"""Counts of writers that do not know the number of triangles when they write the header."""
_CORNER = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)


def announced(content: bytes) -> int:
    """Number of triangles."""
    if _is_text(content):
        return len(re.findall(rb"\bendfacet\b", content, re.IGNORECASE))
    if len(content) < _HEADER:
        return 0
    (count,) = struct.unpack("<I", content[80:_HEADER])
    return (len(content) - _HEADER) // _FACET if count in _STREAMED else int(count)


def read(content: bytes, file_name: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices [3 m, 3] and triangles [m, 3]. Raises PieceError."""
    if _is_text(content):
        try:
            corners = np.array(_CORNER.findall(content), dtype=np.float64).reshape(-1, 3)
        except ValueError:
            raise PieceError(f"{file_name}: a vertex that has not three numbers") from None
        if len(corners) % 3:
            raise PieceError(f"{file_name}: {len(corners)} corners, no multiple of 3; is it cut?")
    else:
        count = announced(content)
        there = max(0, (len(content) - _HEADER) // _FACET)
        if there < count:
            raise PieceError(
                f"{file_name}: it states {count} triangles and holds {there}; is it cut short?"
            )
        facet = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
        facets = np.frombuffer(content, facet, count, _HEADER) if count else np.zeros(0, facet)
        corners = facets["corners"].astype(np.float64).reshape(-1, 3)
    return corners, np.arange(len(corners), dtype=np.int64).reshape(-1, 3)


def _is_text(content: bytes) -> bool:
    """Whether it is ASCII: binary headers may begin with `solid`, too."""
    start = content[:2048].lstrip()
    if start[:5].lower() != b"solid":
        return False
    if len(content) >= _HEADER:
        (count,) = struct.unpack("<I", content[80:_HEADER])
        if len(content) == _HEADER + _FACET * count:
            return False
    return (
        b"\0" not in start
        and re.search(rb"\b(facet|endsolid)\b", content[:65536], re.I) is not None
    )

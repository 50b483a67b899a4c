"""The surface of a piece as polygons and triangles, for pictures and for finding targets."""

import numpy as np
from numpy.typing import NDArray

from world.furniture.piece import Piece

_SIDES = np.array(
    [
        [0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3],
    ]
)  # fmt: skip


def polygons(piece: Piece) -> list[NDArray[np.float64]]:
    """Faces [k, 3] m of its hulls or boxes, anticlockwise from outside, piece frame."""
    if piece.hulls:
        return [
            np.array([hull.vertices_m[i] for i in face])
            for hull in piece.hulls
            for face in hull.faces
        ]
    return [box.corners()[side] for box in piece.boxes for side in _SIDES]


def triangles(piece: Piece) -> NDArray[np.float64]:
    """The surface in triangles, [n, 3, 3] m."""
    return np.array(
        [
            [face[0], face[k], face[k + 1]]
            for face in polygons(piece)
            for k in range(1, len(face) - 1)
        ]
    )

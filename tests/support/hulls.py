"""Pieces of convex hulls, made from the package's own of boxes: what an import gives, for tests."""

from dataclasses import replace

import numpy as np

from world.furniture.piece import Piece
from world.meshes import decompose


def hulled(piece: Piece, extra: int = 0) -> Piece:
    """The piece with a hull for each box, and `extra` corners on each as a cut mesh has them."""
    rng = np.random.default_rng(len(piece.name))
    hulls = []
    for box in piece.boxes:
        corners = box.corners()
        middle = corners.mean(axis=0)
        # on the edges, so that the shape stays the box's
        a, b = corners[rng.integers(0, 8, extra)], corners[rng.integers(0, 8, extra)]
        inner = a + rng.uniform(0.2, 0.8, (extra, 1)) * (b - a)
        outer = middle + 1.0005 * (inner - middle)
        hull = decompose.closed(np.concatenate((corners, outer)))
        assert hull is not None
        hulls.append(hull)
    boxes = tuple(decompose.around(hull) for hull in hulls)
    return replace(piece, name=f"{piece.name}-hulled", hulls=tuple(hulls), boxes=boxes)

"""The common layout of a shard's models, by which one batch steps any mixture of pieces: the number
of collision slots, and of nodes in the bounding-volume trees of the hulls."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from world.errors import PieceError
from world.furniture.piece import SLOTS, Hull, Piece

#: Least number of faces of a filling mesh: a double fan over a triangle.
_FEWEST_FACES = 6
#: A mesh of f faces (f even) has 2f − 1 nodes, so that up to 4 fillings reach any number of them.
_MOST_FILLINGS = 4
_SLACK = _MOST_FILLINGS * (2 * _FEWEST_FACES - 1)


@dataclass(frozen=True)
class Layout:
    """Layout of the furniture in a model; models of one layout can replace each other in a
    batch."""

    slots: int = SLOTS
    """Geoms of the furniture's body."""
    nodes: int = 0
    """Nodes of the bounding-volume trees of its hulls; 0 where no piece has hulls."""


def common(pieces: Sequence[Piece]) -> Layout:
    """The smallest layout that holds all the pieces."""
    if not any(piece.hulls for piece in pieces):
        return Layout()
    slots = max(SLOTS, max(len(piece.boxes) for piece in pieces))
    return Layout(slots, max(nodes(piece) for piece in pieces) + _SLACK)


def exactly(piece: Piece) -> Layout:
    """The layout of a piece that is never replaced: no unused slot, no filling."""
    return Layout(len(piece.boxes), nodes(piece))


def nodes(piece: Piece) -> int:
    """Nodes of the bounding-volume trees of a piece's hulls."""
    return sum(2 * len(hull.faces) - 1 for hull in piece.hulls)


def fillings(piece: Piece, layout: Layout) -> list[int]:
    """Numbers of faces of the unused meshes that fill the piece up to the layout's nodes.

    Raises PieceError where the piece is larger than the layout.
    """
    missing = layout.nodes - nodes(piece)
    if missing == 0:
        return []
    count = -missing % 4 or _MOST_FILLINGS
    faces = (missing + count) // 2
    each = faces // count // 2 * 2
    if len(piece.boxes) > layout.slots or each < _FEWEST_FACES:
        raise PieceError(f"{piece.name}: its hulls are larger than the layout of these scenes")
    return [faces - (count - 1) * each, *[each] * (count - 1)]


def add_hull(spec: mujoco.MjSpec, name: str, hull: Hull) -> None:
    """Add a hull as a mesh of this name."""
    spec.add_mesh(
        name=name,
        uservert=np.array(hull.vertices_m, dtype=np.float64).ravel().tolist(),
        userface=np.array(hull.faces, dtype=np.int64).ravel().tolist(),
    )


def add_filling(spec: mujoco.MjSpec, name: str, faces: int) -> None:
    """Add a closed double fan of so many faces (even, 6 or more), which no geom uses."""
    rim = faces // 2
    angle = 2 * math.pi * np.arange(rim) / rim
    around = np.stack((np.cos(angle), np.sin(angle), np.zeros(rim)), axis=1)
    following = np.roll(np.arange(rim), -1)
    upper = np.stack((np.arange(rim), following, np.full(rim, rim)), axis=1)
    lower = np.stack((following, np.arange(rim), np.full(rim, rim + 1)), axis=1)
    spec.add_mesh(
        name=name,
        uservert=np.concatenate((around, [[0, 0, 1.0], [0, 0, -1.0]])).ravel().tolist(),
        userface=np.concatenate((upper, lower)).ravel().tolist(),
    )

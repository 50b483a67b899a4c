"""The original mesh of an imported piece, whose convex hulls are coarser."""

import hashlib
from pathlib import Path

import numpy as np

from console.animation.objects import Shape, surface
from console.animation.skeleton import Array
from console.video import stage
from world.errors import InhabitError
from world.furniture.piece import Hull, Piece
from world.meshes import source, store, upright
from world.meshes.build import ImportOptions

#: The mesh is that of the piece where this fraction of its triangles is inside the hulls, or at
#: most this far outside, m.
_INSIDE, _NEAR_M = 0.95, 0.04


def of_object(word: str | None, piece: Piece | None, scale: float) -> Shape | None:
    """Return the surface of the object of a command, in the frame of its piece at `scale`.

    word: a mesh, or the file of an imported piece beside its unchanged mesh. None where there is no
    mesh, or where it was imported with axes or a unit of its own, which the piece does not state.
    """
    if word is None or piece is None or not piece.hulls:
        return None
    path = Path(word)
    try:
        mesh = _beside(path) if word.endswith(store.SUFFIX) else path
        if mesh is None or mesh.suffix.lower() not in source.SUFFIXES:
            return None
        triangles = scale * upright.upright(source.read(mesh), ImportOptions().frame)
    except (InhabitError, OSError):
        return None
    if _inside(piece.hulls, triangles.mean(axis=1)) < _INSIDE:
        return None
    corners = triangles.reshape(-1, 3)
    return surface(corners, np.arange(len(corners)).reshape(-1, 3), stage.BOX)


def _beside(path: Path) -> Path | None:
    """Return the mesh from which a piece was imported, if it lies beside the piece's file,
    unchanged."""
    said = store.read_document(path).get("source")
    if not isinstance(said, dict):
        return None
    mesh = path.parent / str(said.get("file", ""))
    if not mesh.is_file() or mesh.stat().st_size > source.MAX_BYTES:
        return None
    digest = hashlib.sha256(mesh.read_bytes()).hexdigest()
    return mesh if digest == said.get("sha256") else None


def _inside(hulls: tuple[Hull, ...], points: Array) -> float:
    """Return the fraction of points [n, 3] that are in a hull or near it."""
    within = np.zeros(len(points), bool)
    for hull in hulls:
        corners = np.array(hull.vertices_m)[np.array(hull.faces)]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        size = np.linalg.norm(normal, axis=1)
        normal, first = normal[size > 0] / size[size > 0, None], corners[size > 0, 0]
        away = points @ normal.T - np.sum(normal * first, axis=1)
        within |= away.max(axis=1) < _NEAR_M
    return float(within.mean()) if len(within) else 0.0

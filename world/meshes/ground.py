"""Ground planes of meshes: what a piece stands on."""

import numpy as np
from numpy.typing import NDArray

THIN, FLAT = 0.06, 0.004
"""Greatest thickness of a ground slab and of a ground plane, as fractions of the height of all."""
SLAB_AREA, PLANE_AREA = 2.0, 1.05
"""Least area of their bounding rectangles, as multiples of that of the rest."""
COVERED = 0.5
"""Least fraction of its bounding rectangle that a ground covers: feet do not."""


Triangles = NDArray[np.float64]


def plane(triangles: Triangles) -> NDArray[np.bool_] | None:
    """[m]: the triangles of a ground plane or slab below all else and beyond it on every side; None
    without one. Any unit, z up."""
    bottom, top = triangles[..., 2].min(), triangles[..., 2].max()
    highest = triangles[..., 2].max(axis=1)
    for thickness, area in ((FLAT, PLANE_AREA), (THIN, SLAB_AREA)):
        ground = highest <= bottom + thickness * (top - bottom)
        if not ground.any() or ground.all():
            continue
        below, rest = (triangles[which, :, :2].reshape(-1, 2) for which in (ground, ~ground))
        margin = 0.005 * np.ptp(rest, axis=0)
        beyond = (below.min(axis=0) < rest.min(axis=0) - margin).all() and (
            below.max(axis=0) > rest.max(axis=0) + margin
        ).all()
        rectangle = float(np.ptp(below, axis=0).prod())
        a, b, c = (triangles[ground, k, :2] for k in range(3))
        covered = 0.5 * float(np.abs(_crossed(b - a, c - a)).sum())
        if (
            beyond
            and rectangle >= area * float(np.ptp(rest, axis=0).prod())
            and covered >= COVERED * rectangle
        ):
            return _reaching_out(triangles, ground, rest)
    return None


def _reaching_out(
    triangles: Triangles, ground: NDArray[np.bool_], rest: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """[m]: of the lowest triangles the connected ones that reach beyond the rest [k, 2]: the
    undersides of feet belong to the piece."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    corners = triangles[ground].reshape(-1, 3)
    grain = float(np.ptp(corners, axis=0).max()) * 1e-6
    _, number = np.unique((corners / grain).round(), axis=0, return_inverse=True)
    number = number.reshape(-1, 3)
    count = int(number.max()) + 1
    pairs = np.concatenate((number[:, :2], number[:, 1:]))
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (count, count))
    _, label = connected_components(graph, directed=False)
    part = label[number[:, 0]]
    flat = triangles[ground, :, :2]
    out = (flat < rest.min(axis=0)).any(axis=(1, 2)) | (flat > rest.max(axis=0)).any(axis=(1, 2))
    result = ground.copy()
    result[ground] = np.isin(part, np.unique(part[out]))
    return result


def _crossed(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """[n]: cross products of vectors [n, 2]."""
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]

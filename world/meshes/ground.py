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
            return ground
    return None


def _crossed(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """[n]: cross products of vectors [n, 2]."""
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]

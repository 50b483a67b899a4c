"""The upward axis of a mesh whose file states none, from its geometry.

Furniture has an ordinary size with its seat or top facing up, stands on a broad base, and looks
different upside down; a piece that lies on its back or side does so less. The weights are fitted to
94 real pieces in 376 lying poses, of which they tell 373 from the upright one; by the names of
formats alone half of all OBJ files would lie.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from world.errors import PieceError
from world.meshes import frame as frames
from world.meshes import ground, hints
from world.meshes.frame import METRES, Axis, Frame
from world.meshes.source import Source

#: Weights of unlikeness (up to 1), asymmetry and support in the score of an axis.
UNLIKE, ASYMMETRIC, SUPPORTED = 3.5, 4.3, 4.0
#: Excess of the score at which the other usual axis is taken, and one at which an odd one is named.
TAKEN, NAMED = 0.2, 1.2
_UNUSUAL: tuple[Axis, ...] = ("-y", "+x", "-x")
_SAMPLES, _BINS = 20_000, 12
_FLOOR_M, _FLOOR_SHARE = 0.01, 0.02
"""Height above the floor, and its fraction of the whole, up to which a piece stands on it."""

Triangles = NDArray[np.float64]
Points = NDArray[np.float64]


def resolved(source: Source, frame: Frame, force: bool = False) -> tuple[Frame, tuple[str, ...]]:
    """The frame with the upward axis that the geometry states, and a remark where it is not that of
    the format.

    A stated axis, a catalogue's size and glTF's own axis stay. Raises PieceError, unless forced,
    for a piece that stands along none of the usual axes but clearly along another one.
    """
    usual = frames.default_up(source.suffix)
    if frame.up is not None or frame.size_m is not None or source.suffix in (".glb", ".gltf"):
        return frame, ()
    up, best = usual, _score(source, frame, usual, -math.inf) or -math.inf
    other: Axis = "+y" if usual == "+z" else "+z"
    if (found := _score(source, frame, other, best + TAKEN)) is not None:
        up, best = other, found
    if math.isinf(best):
        return frame, ()  # no size of furniture along either: the refusal names unit and axis
    better, most = up, best + NAMED
    for axis in () if force else _UNUSUAL:
        if (found := _score(source, frame, axis, most)) is not None:
            better, most = axis, found
    if better != up:
        _require_unit(source, frame, better)
        # upside down alone is too much like upright to be refused, but may be nearer than a side
        if usual == "+z" and _score(source, frame, "-z", most) is not None:
            better = "-z"
        raise PieceError(
            f"{source.name}: lies on its back or side with {up} up, and stands with --up {better};"
            f" give that, or --up {up} to keep it"
        )
    if up == usual:
        return frame, ()
    return replace(frame, up=up), (
        f"taken with {up[1]} up, as it stands so; --up {usual} and --up {up} state it",
    )


def _require_unit(source: Source, frame: Frame, up: Axis) -> None:
    """Raise PieceError where another unit explains an odd size that no axis makes ordinary."""
    if frame.unit is not None or frame.height_m is not None:
        return
    triangles = _turned(source, replace(frame, up=up))
    if triangles is None or hints.unlikeness(triangles) < hints.ODD:
        return
    flags = hints.flags(source, frame, within=hints.ORDINARY)
    if "--unit" in flags:
        usual = source.triangles() @ frames.turn(source.suffix, frame).T
        size = " x ".join(f"{x:.2f}" for x in np.ptp(usual.reshape(-1, 3), axis=0))
        raise PieceError(
            f"{source.name}: {size} m (x, y, z) is odd, and with {flags} it is ordinary furniture;"
            " give that, or --force to keep it"
        )


def _score(source: Source, frame: Frame, up: Axis, above: float) -> float | None:
    """The score of an upward axis where it is above a number; None else."""
    if frame.front is not None and frame.front[1] == up[1]:
        return None
    triangles = _turned(source, replace(frame, up=up))
    found = -math.inf if triangles is None else score(triangles, above)
    return found if found > above else None


def score(triangles_m: Triangles, above: float = -math.inf) -> float:
    """How much furniture [m, 3, 3] m, z up, stands upright; larger is likelier.

    above: a lower score need not be exact; the unlikeness takes the longest.
    """
    points = _sampled(triangles_m)
    found = SUPPORTED * support(points) + ASYMMETRIC * asymmetry(points)
    if found <= above:
        return found
    return found - UNLIKE * min(hints.unlikeness(triangles_m), 1.0)


def asymmetry(points: Points) -> float:
    """Difference of the distribution of points [n, 3] from its image upside down, 0 to 1."""
    size = np.ptp(points, axis=0)
    low = points.min(axis=0)
    counts, _ = np.histogramdd(
        points, bins=_BINS, range=[(a, a + max(s, 1e-9)) for a, s in zip(low, size, strict=True)]
    )
    return float(np.abs(counts - counts[..., ::-1]).sum() / 2 / len(points))


def support(points: Points) -> float:
    """Area of the convex hull of the points [n, 3] on the floor, as a fraction of the bounding
    rectangle."""
    from scipy.spatial import ConvexHull, QhullError

    size = np.ptp(points, axis=0)
    height = points[:, 2] - points[:, 2].min()
    standing = points[height < _FLOOR_M + _FLOOR_SHARE * size[2], :2]
    try:
        return float(ConvexHull(standing).volume / max(size[0] * size[1], 1e-9))
    except (QhullError, ValueError):
        return 0.0  # a point or an edge


def _turned(source: Source, frame: Frame) -> Triangles | None:
    """Triangles in metres along the frame's axes, without a ground plane; None for a size that no
    furniture has."""
    triangles = source.triangles() @ frames.turn(source.suffix, frame).T
    below = ground.plane(triangles)
    triangles = triangles if below is None else triangles[~below]
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    factor = METRES[frame.unit or "m"]
    if frame.height_m is not None:
        factor = frame.height_m / max(float(high[2] - low[2]), 1e-9)
    if not hints.fits((high - low) * factor):
        return None
    triangles = (triangles - (low + high) / 2) * factor
    triangles[..., 2] -= triangles[..., 2].min()
    return triangles


def _sampled(triangles: Triangles) -> Points:
    """Points [n, 3] on the surface, as many on equal areas; the same for the same mesh."""
    sides = triangles[:, 1:] - triangles[:, :1]
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    total = float(area.sum())
    corners = triangles.reshape(-1, 3)
    if total <= 0.0:
        return corners
    generator = np.random.default_rng(0)
    chosen = generator.choice(len(triangles), _SAMPLES, p=area / total)
    u, v = np.sqrt(generator.random(_SAMPLES)), generator.random(_SAMPLES)
    weights = np.stack((1.0 - u, u * (1.0 - v), u * v), axis=1)
    extremes = corners[np.concatenate((corners.argmin(axis=0), corners.argmax(axis=0)))]
    return np.concatenate((np.einsum("nk,nkd->nd", weights, triangles[chosen]), extremes))

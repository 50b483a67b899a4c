"""Normalisation of a mesh: metres, z up, +x front, origin on the floor below the centre; a ground
plane is left out, and implausible sizes are refused."""

import numpy as np
from numpy.typing import NDArray

from world.errors import PieceError
from world.meshes import frame as frames
from world.meshes import ground, hints
from world.meshes.frame import METRES, Frame
from world.meshes.source import Source

GAP_M = 0.08
"""Parts farther apart than this belong to different objects."""
PART_SHARE = 0.3
"""Detached parts smaller than this fraction of the largest are its feet or cushions."""
MOST_PARTS = 1500

Triangles = NDArray[np.float64]


def upright(source: Source, frame: Frame) -> Triangles:
    """Triangles [m, 3, 3] in the piece's frame. Raises PieceError, ConfigError."""
    return placed(source, frame)[0]


def placed(
    source: Source, frame: Frame, named: str | None = None
) -> tuple[Triangles, tuple[str, ...]]:
    """Triangles [m, 3, 3] in the piece's frame, and remarks. Raises PieceError, ConfigError.

    named: a class that the name states, for the hint.
    """
    triangles = source.triangles() @ frames.turn(source.suffix, frame).T
    # a catalogue states the size of all that the file holds
    below = None if frame.size_m is not None else ground.plane(triangles)
    plane = np.zeros(3)
    if below is not None:
        plane = np.ptp(triangles[below].reshape(-1, 3), axis=0)
        triangles = triangles[~below]
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    extent = high - low
    if float(extent.max()) <= 0.0:
        raise PieceError(f"{source.name}: a mesh without extent")
    if frame.size_m is not None:
        scale = np.array(frame.size_m) / np.maximum(extent, 1e-9)
    elif frame.height_m is not None:
        if extent[2] <= 0.0:
            raise PieceError(f"{source.name}: flat; it has no height to scale")
        scale = np.full(3, frame.height_m / extent[2])
    else:
        scale = np.full(3, METRES[frame.unit or "m"])
    triangles = (triangles - (low + high) / 2) * scale
    triangles[..., 2] -= triangles[..., 2].min()
    count = _pieces(triangles)
    if count > 1:
        raise PieceError(f"{source.name}: a scene of {count} objects; export one piece a file")
    if not hints.fits(extent * scale):
        shown = " x ".join(f"{x:.3g}" for x in extent * scale)
        flags = hints.flags(source, frame, named) or "--unit, --height or --up"
        raise PieceError(f"{source.name}: {shown} m (x, y, z) is no furniture; give {flags}")
    if below is None:
        return triangles, ()
    x, y, _ = plane * scale
    return triangles, (f"a ground plane of {x:.2f} x {y:.2f} m is left out",)


def _pieces(triangles: Triangles) -> int:
    """Number of separate objects: groups of parts whose bounding rectangles on the floor are at
    least GAP_M apart (in proportion, for any unit); small ones do not count."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    flat = triangles.reshape(-1, 3)
    extent = float((flat.max(axis=0) - flat.min(axis=0)).max())
    # parts: triangles that share a corner
    _, corner = np.unique(np.round(flat / extent, 5), axis=0, return_inverse=True)
    corner = corner.reshape(-1, 3)
    count = int(corner.max()) + 1
    pairs = np.concatenate((corner[:, :2], corner[:, 1:]))
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (count, count))
    parts, label = connected_components(graph, directed=False)
    of = label[corner[:, 0]]
    low = np.full((parts, 3), np.inf)
    high = np.full((parts, 3), -np.inf)
    np.minimum.at(low, of, triangles.min(axis=1))
    np.maximum.at(high, of, triangles.max(axis=1))
    if parts > MOST_PARTS:  # the largest decide
        kept = np.argsort(-(high - low).max(axis=1))[:MOST_PARTS]
        low, high = low[kept], high[kept]
    apart = np.maximum(low[:, None, :2] - high[None, :, :2], low[None, :, :2] - high[:, None, :2])
    # furniture in metres; other units in proportion to a piece of 1.5 m
    grain = 1.0 if extent < hints.WIDEST_M else extent / 6.0
    near = apart.max(axis=2) < GAP_M * grain
    groups, group = connected_components(coo_matrix(near), directed=False)
    sizes = [
        np.sort(high[group == g].max(axis=0) - low[group == g].min(axis=0))[1]
        for g in range(groups)
    ]
    return sum(size > PART_SHARE * max(sizes) for size in sizes)

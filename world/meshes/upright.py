"""Normalisation of a mesh: metres, z up, +x front, origin on the floor below the centre;
implausible sizes are refused."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from world.errors import ConfigError, PieceError
from world.meshes.source import Source

Axis = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
Unit = Literal["m", "cm", "mm", "in", "ft"]

METRES: dict[Unit, float] = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
HEIGHTS_M = (0.10, 2.60)
WIDEST_M = 4.5
"""Sizes beyond these are not furniture for one person's use."""
NARROWEST_M = 0.05
GAP_M = 0.08
"""Parts farther apart than this belong to different objects."""
PART_SHARE = 0.3
"""Detached parts smaller than this fraction of the largest are its feet or cushions."""
MOST_PARTS = 1500


@dataclass(frozen=True)
class Frame:
    """Axes and size of a file's mesh; None: the format's convention."""

    up: Axis | None = None
    front: Axis | None = None
    unit: Unit | None = None
    height_m: float | None = None
    """Scale to this height instead of by a unit."""
    size_m: tuple[float, float, float] | None = None
    """Scale to this box (x, y, z in the piece's frame), from a catalogue."""


def upright(source: Source, frame: Frame) -> NDArray[np.float64]:
    """Triangles [m, 3, 3] in the piece's frame. Raises PieceError, ConfigError."""
    triangles = source.triangles() @ _turn(source.suffix, frame).T
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
    _plausible(source.name, extent * scale)
    return triangles


def _turn(suffix: str, frame: Frame) -> NDArray[np.float64]:
    """Rotation [3, 3] from the file's axes to the piece's."""
    y_up = suffix in (".glb", ".gltf")
    up = frame.up or ("+y" if y_up else "+z")
    # glTF defines +z as the front; it is the convention of other formats with y up, too
    front = frame.front or ("+z" if up[1] == "y" else "+x" if up[1] == "z" else "+y")
    if up[1] == front[1]:
        raise ConfigError(f"--up {up} --front {front}: choose two different axes")
    x, z = _axis(front), _axis(up)
    return np.stack((x, np.cross(z, x), z))


def _axis(name: str) -> NDArray[np.float64]:
    axis = np.zeros(3)
    axis["xyz".index(name[1])] = 1.0 if name[0] == "+" else -1.0
    return axis


def _plausible(name: str, size_m: NDArray[np.float64]) -> None:
    """Raise PieceError for an implausible size, with the unit that gives a plausible one."""
    if _fits(size_m):
        return
    shown = " x ".join(f"{x:.3g}" for x in size_m)
    units = [u for u, factor in METRES.items() if factor != 1.0 and _fits(size_m * factor)]
    hint = f"--unit {units[0]}" if units else "--unit, --height or --up"
    raise PieceError(f"{name}: {shown} m (x, y, z) is no furniture; give {hint}")


def _fits(size_m: NDArray[np.float64]) -> bool:
    x, y, z = size_m
    low, high = HEIGHTS_M
    return bool(low <= z <= high and min(x, y) >= NARROWEST_M and max(x, y) <= WIDEST_M)


def _pieces(triangles: NDArray[np.float64]) -> int:
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
    grain = 1.0 if extent < WIDEST_M else extent / 6.0
    near = apart.max(axis=2) < GAP_M * grain
    groups, group = connected_components(coo_matrix(near), directed=False)
    sizes = [
        np.sort(high[group == g].max(axis=0) - low[group == g].min(axis=0))[1]
        for g in range(groups)
    ]
    return sum(size > PART_SHARE * max(sizes) for size in sizes)

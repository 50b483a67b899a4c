"""The relief of a piece: the height of its usable surface on a fine grid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

CELL_M = 0.02
"""Edge of a cell."""
PER_CELL = 6.0
"""Sampled points per cell area of surface."""
HEADROOM_M = 0.75
"""Free height above a surface that a sitting person needs."""
VOXEL_M = 0.04
"""Edge of the voxels in which the space around a piece is followed."""
TRUNK_M = 0.30
"""Height above a sheltered surface that must be reached from outside."""
LEVEL_M = 0.03
"""Height of a level of surfaces."""
LOWEST_LEVEL_M = 0.12
"""Least height of the main level."""
SLIT_M = 0.07
"""Greatest gap between slats, cushions and wires that still carries a person."""
MAX_POINTS = 3_000_000

Points = NDArray[np.float64]


@dataclass(frozen=True)
class Relief:
    """Heights on a grid: cell (i, j) is centred at low + ((i, j) + 1/2) CELL_M, piece frame."""

    height_m: NDArray[np.float64]
    """[nx, ny]: of the usable surface, slits closed; 0 is the floor."""
    raw_m: NDArray[np.float64]
    """[nx, ny]: the same with open slits."""
    low_m: NDArray[np.float64]
    """[2]: the grid's corner."""

    def centres(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """x [nx] and y [ny] of the cells' centres, m."""
        nx, ny = self.height_m.shape
        return (
            self.low_m[0] + (np.arange(nx) + 0.5) * CELL_M,
            self.low_m[1] + (np.arange(ny) + 0.5) * CELL_M,
        )

    def at(self, x: Points, y: Points, raw: bool = False) -> Points:
        """Heights at the given coordinates (any shape), 0 beyond the grid."""
        grid = self.raw_m if raw else self.height_m
        i = np.floor((x - self.low_m[0]) / CELL_M).astype(np.int64)
        j = np.floor((y - self.low_m[1]) / CELL_M).astype(np.int64)
        nx, ny = grid.shape
        inside = (i >= 0) & (i < nx) & (j >= 0) & (j < ny)
        return np.where(inside, grid[i.clip(0, nx - 1), j.clip(0, ny - 1)], 0.0)


def relief(triangles_m: Points) -> Relief:
    """The surface under open space: the highest of each column. Triangles [n, 3, 3] in m, z up,
    standing on z = 0."""
    points = _sampled(triangles_m)
    low, shape = _grid(points)
    return _relief(_highest(points, low, shape), low)


def sheltered(triangles_m: Points) -> Relief:
    """The same for a piece with a roof, as a canopy or an upper bunk: the lowest surface of each
    column with HEADROOM_M above it that is reached from outside."""
    points = _sampled(triangles_m)
    low, shape = _grid(points)
    return _relief(_lowest_free(points, low, shape), low)


def main_level(surface: Relief) -> tuple[float, float]:
    """Height of the level of the largest area, m, and its fraction of the bounding rectangle."""
    heights = surface.height_m[surface.height_m > LOWEST_LEVEL_M]
    if not heights.size:
        return 0.0, 0.0
    ordered = np.sort(heights)
    counts = np.searchsorted(ordered, ordered + LEVEL_M, side="right") - np.arange(len(ordered))
    most = int(np.argmax(counts))
    level = float(np.median(ordered[most : most + int(counts[most])]))
    nx, ny = surface.height_m.shape  # with a margin of two cells
    return level, float(counts[most]) / max((nx - 2) * (ny - 2), 1)


def _grid(points: Points) -> tuple[NDArray[np.float64], tuple[int, int]]:
    low = points[:, :2].min(axis=0) - CELL_M
    shape = np.ceil((points[:, :2].max(axis=0) - low) / CELL_M).astype(np.int64) + 1
    return low, (int(shape[0]), int(shape[1]))


def _relief(raw: Points, low: NDArray[np.float64]) -> Relief:
    slit = round(SLIT_M / CELL_M)
    closed = ndimage.grey_closing(raw, size=(slit, slit), mode="constant")
    return Relief(closed, raw, low)


def _sampled(triangles_m: Points) -> Points:
    """Points [m, 3] spread evenly over the triangles, deterministic."""
    a, b, c = triangles_m[:, 0], triangles_m[:, 1], triangles_m[:, 2]
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    total = float(area.sum())
    count = int(min(MAX_POINTS, max(2000.0, PER_CELL * total / CELL_M**2)))
    edges = np.cumsum(area)
    which = np.searchsorted(edges, (np.arange(count) + 0.5) / count * total).clip(0, len(area) - 1)
    # the R2 sequence (Roberts 2018) fills the unit square evenly; folded into a triangle
    index = np.arange(count)
    u, v = (0.5 + 0.7548776662466927 * index) % 1.0, (0.5 + 0.5698402909980532 * index) % 1.0
    over = u + v > 1.0
    u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
    origin = a[which]
    return origin + u[:, None] * (b[which] - origin) + v[:, None] * (c[which] - origin)


def _highest(points: Points, low: NDArray[np.float64], shape: tuple[int, int]) -> Points:
    """[nx, ny]: greatest height of each column; 0: the floor."""
    cell = np.floor((points[:, :2] - low) / CELL_M).astype(np.int64)
    grid = np.zeros(shape[0] * shape[1])
    np.maximum.at(grid, cell[:, 0] * shape[1] + cell[:, 1], points[:, 2])
    return grid.reshape(shape)


def _lowest_free(points: Points, low: NDArray[np.float64], shape: tuple[int, int]) -> Points:
    """[nx, ny]: height of the lowest reached surface of each column with HEADROOM_M above it; 0:
    the floor."""
    cell = np.floor((points[:, :2] - low) / CELL_M).astype(np.int64)
    column = cell[:, 0] * shape[1] + cell[:, 1]
    order = np.lexsort((points[:, 2], column))
    column, z = column[order], points[order, 2]
    above = np.append(z[1:], np.inf)
    last = np.append(column[1:] != column[:-1], True)
    trunk = np.column_stack((points[order, :2], z + TRUNK_M))
    free = last | ((above - z > HEADROOM_M) & _reached(points, trunk))
    # the floor counts where the lowest surface is out of reach of a head
    first = np.append(True, last[:-1])
    floor_free = np.zeros(shape[0] * shape[1], dtype=bool)
    floor_free[column[first & (z > HEADROOM_M + 0.4)]] = True
    grid = np.full(shape[0] * shape[1], np.inf)
    np.minimum.at(grid, column[free], z[free])
    grid[floor_free | ~np.isfinite(grid)] = 0.0
    return grid.reshape(shape)


def _reached(surface: Points, places: Points) -> NDArray[np.bool_]:
    """[k]: whether places [k, 3] are reached from outside of the surface's points [n, 3], through
    openings of more than about 12 cm: the inside of an arm or a drawer is not."""
    low = surface.min(axis=0) - 3 * VOXEL_M
    shape = np.ceil((surface.max(axis=0) - low) / VOXEL_M).astype(np.int64) + 4
    solid = np.zeros(tuple(int(n) for n in shape), dtype=bool)
    at = np.floor((surface - low) / VOXEL_M).astype(np.int64)
    solid[tuple(at.T)] = True
    cube = np.ones((3, 3, 3), dtype=bool)
    narrow: NDArray[np.bool_] = np.asarray(ndimage.binary_dilation(solid, cube), dtype=bool)
    spaces = np.zeros(solid.shape, dtype=np.int32)
    ndimage.label(~narrow, output=spaces)
    outside = spaces == spaces[-1, -1, -1]  # a corner of the margin
    outside = np.asarray(ndimage.binary_dilation(outside, iterations=2, mask=~solid), dtype=bool)
    index = np.floor((places - low) / VOXEL_M).astype(np.int64)
    index = index.clip(0, np.array(solid.shape) - 1)
    return outside[tuple(index.T)]

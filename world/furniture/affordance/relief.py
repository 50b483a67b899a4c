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
SLIT_M = 0.07
"""Greatest gap between slats, cushions and wires that still carries a person."""
MAX_POINTS = 3_000_000

Points = NDArray[np.float64]


@dataclass(frozen=True)
class Relief:
    """Heights on a grid: cell (i, j) is centred at low + ((i, j) + 1/2) CELL_M, piece frame."""

    height_m: NDArray[np.float64]
    """[nx, ny]: of the lowest surface with HEADROOM_M above it, slits closed; 0 is the floor."""
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
    """The relief of triangles [n, 3, 3] in m, z up, standing on z = 0."""
    points = _sampled(triangles_m)
    low = points[:, :2].min(axis=0) - CELL_M
    shape = np.ceil((points[:, :2].max(axis=0) - low) / CELL_M).astype(np.int64) + 1
    raw = _lowest_free(points, low, (int(shape[0]), int(shape[1])))
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


def _lowest_free(points: Points, low: NDArray[np.float64], shape: tuple[int, int]) -> Points:
    """[nx, ny]: height of the lowest surface of each column with HEADROOM_M above it; 0: the
    floor."""
    cell = np.floor((points[:, :2] - low) / CELL_M).astype(np.int64)
    column = cell[:, 0] * shape[1] + cell[:, 1]
    order = np.lexsort((points[:, 2], column))
    column, z = column[order], points[order, 2]
    above = np.append(z[1:], np.inf)
    last = np.append(column[1:] != column[:-1], True)
    free = last | (above - z > HEADROOM_M)
    # the floor counts where the lowest surface is out of reach of a head
    first = np.append(True, last[:-1])
    floor_free = np.zeros(shape[0] * shape[1], dtype=bool)
    floor_free[column[first & (z > HEADROOM_M + 0.4)]] = True
    grid = np.full(shape[0] * shape[1], np.inf)
    np.minimum.at(grid, column[free], z[free])
    grid[floor_free | ~np.isfinite(grid)] = 0.0
    return grid.reshape(shape)

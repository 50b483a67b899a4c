"""The free floor of a room: what a walking character keeps clear of, and ways around it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from console.kinds.setup import Pose
from world.furniture.piece import Piece

Points = NDArray[np.float64]
#: Half of the edge of the planned square about the origin, and the edge of its cells, m.
REACH_M, CELL_M = 6.0, 0.1
#: Distance of the root from what it passes, m: half of the width of the swinging arms.
CLEARANCE_M = 0.35
_NEIGHBOURS = ((0, 1), (1, 0), (1, 1), (1, -1))


@dataclass(frozen=True)
class Footprint:
    """The rectangle that a piece covers."""

    centre: tuple[float, float]
    """World, m."""
    half: tuple[float, float]
    """Half of its edges along its own axes, m."""
    yaw: float
    """Of its first axis, rad."""

    @staticmethod
    def of(piece: Piece, pose: Pose) -> "Footprint":
        """The footprint of a piece whose origin has a pose."""
        low, high = piece.bounds()
        middle, half = (low + high)[:2] / 2, (high - low)[:2] / 2
        cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
        x, y = middle.tolist()
        centre = pose.x + cos * x - sin * y, pose.y + sin * x + cos * y
        return Footprint(centre, (float(half[0]), float(half[1])), pose.yaw)

    def distance_m(self, points: Points) -> Points:
        """Distances [...] of points [..., 2], 0 within."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        offset = points - np.array(self.centre)
        own = np.stack(
            (
                cos * offset[..., 0] + sin * offset[..., 1],
                cos * offset[..., 1] - sin * offset[..., 0],
            ),
            axis=-1,
        )
        outside = np.maximum(np.abs(own) - np.array(self.half), 0.0)
        return np.linalg.norm(outside, axis=-1)


class FloorPlan:
    """The floor with what stands on it; points are [2] m, world."""

    def __init__(self, footprints: Sequence[Footprint]) -> None:
        self._footprints = tuple(footprints)
        count = round(2 * REACH_M / CELL_M) + 1
        axis = np.linspace(-REACH_M, REACH_M, count)
        self._cells = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1)
        self._free = self.free(self._cells)

    def free(self, points: Points) -> NDArray[np.bool_]:
        """Whether a character can stand at points [..., 2]: [...]."""
        found = np.ones(points.shape[:-1], np.bool_)
        for footprint in self._footprints:
            found &= footprint.distance_m(points) >= CLEARANCE_M
        return found

    def clear(self, begin: Points, end: Points) -> bool:
        """Whether the straight way between two points is free. A point that is not free does not
        count: a character that stands close to a piece may walk away from it."""
        count = max(2, math.ceil(float(np.linalg.norm(end - begin)) / (CELL_M / 2)))
        line = begin + np.linspace(0.0, 1.0, count)[:, None] * (end - begin)
        free = self.free(line)
        inside = np.flatnonzero(free)
        if not len(inside):
            return False
        return bool(free[inside[0] : inside[-1] + 1].all()) and bool(
            np.linalg.norm(line[inside[0]] - begin) <= CLEARANCE_M
            and np.linalg.norm(line[inside[-1]] - end) <= CLEARANCE_M
        )

    def nearest_free(self, point: Points) -> Points:
        """The free point nearest to one: itself, or the centre of a cell."""
        if bool(self.free(point)) or not self._free.any():
            return point
        distance = np.linalg.norm(self._cells - point, axis=-1)
        distance[~self._free] = np.inf
        return self._cells[np.unravel_index(int(distance.argmin()), distance.shape)].copy()

    def way(self, begin: Points, end: Points) -> list[Points]:
        """Points of the shortest way over free cells, without its begin, with its end; the end
        alone where none leads there."""
        if self.clear(begin, end):
            return [end]
        first, last = (self._cell(self.nearest_free(point)) for point in (begin, end))
        numbers, graph = self._graph()
        if numbers[first] < 0 or numbers[last] < 0:
            return [end]
        source, sink = int(numbers[first]), int(numbers[last])
        _, before = dijkstra(graph, directed=False, indices=source, return_predecessors=True)
        if before[sink] < 0:
            return [end]
        cells = self._cells[self._free]
        steps = [sink]
        while steps[-1] != source:
            steps.append(int(before[steps[-1]]))
        return self._straightened([begin, *(cells[i] for i in reversed(steps)), end])

    def _cell(self, point: Points) -> tuple[int, int]:
        index = np.clip(np.round((point + REACH_M) / CELL_M), 0, len(self._cells) - 1).astype(int)
        return int(index[0]), int(index[1])

    def _graph(self) -> tuple[NDArray[np.int64], csr_matrix]:
        """Numbers of the free cells, -1 elsewhere, and the lengths between neighbours, m."""
        numbers = np.where(self._free, np.cumsum(self._free).reshape(self._free.shape) - 1, -1)
        rows, columns, lengths = [], [], []
        side = len(numbers)
        for down, right in _NEIGHBOURS:
            here = numbers[: side - down, max(0, -right) : side - max(0, right)]
            there = numbers[down:, max(0, right) : side + min(0, right)]
            both = (here >= 0) & (there >= 0)
            rows.append(here[both])
            columns.append(there[both])
            lengths.append(np.full(int(both.sum()), CELL_M * math.hypot(down, right)))
        count = int(self._free.sum())
        where = np.concatenate(rows), np.concatenate(columns)
        return numbers, csr_matrix((np.concatenate(lengths), where), shape=(count, count))

    def _straightened(self, way: list[Points]) -> list[Points]:
        """The way without points that a straight line can leave out, without its begin."""
        found, at = [], 0
        while at < len(way) - 1:
            following = at + 1
            for later in range(len(way) - 1, at + 1, -1):
                if self.clear(way[at], way[later]):
                    following = later
                    break
            found.append(way[following])
            at = following
        return found

"""What is under the pointer: the ray of a click against boxes and the floor."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Block:
    """A box that can be clicked, upright, world frame."""

    low: tuple[float, float, float]
    """Lowest corner in its own frame, m."""
    high: tuple[float, float, float]
    origin: tuple[float, float, float]
    """World position of its frame, m."""
    yaw: float
    """Of its frame, rad."""

    def hit_m(self, origin: Vector, direction: Vector) -> float:
        """Distance along a ray, in lengths of its direction, at which it enters; infinite past it.

        The slab method (Kay & Kajiya 1986).
        """
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        turn = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
        begin, along = turn @ (origin - np.array(self.origin)), turn @ direction
        with np.errstate(divide="ignore", invalid="ignore"):
            near = (np.array(self.low) - begin) / along
            far = (np.array(self.high) - begin) / along
        enter = float(np.nanmax(np.minimum(near, far)))
        leave = float(np.nanmin(np.maximum(near, far)))
        return enter if 0.0 <= enter <= leave else math.inf


def picked(
    blocks: Mapping[str, Block], origin: Vector, direction: Vector
) -> tuple[str, tuple[float, float]] | None:
    """The name of the first block that a ray hits, or "" where it hits the floor first, and the
    point on the floor plane below it [2], m; None where it hits nothing."""
    hits = {name: block.hit_m(origin, direction) for name, block in blocks.items()}
    floor = -origin[2] / direction[2] if direction[2] < 0.0 else math.inf
    hits[""] = floor if floor >= 0.0 else math.inf
    name = min(hits, key=lambda key: hits[key])
    if math.isinf(hits[name]):
        return None
    x, y, _ = (origin + hits[name] * direction).tolist()
    return name, (x, y)

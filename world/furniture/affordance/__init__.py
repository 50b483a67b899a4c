"""Targets for sitting and lying, found from the geometry of a piece alone."""

import numpy as np

from world.furniture.affordance.relief import Relief
from world.furniture.affordance.seats import LEVEL_M, PELVIS, zone_heights


def level(relief: Relief, point_m: tuple[float, float], heading: float, near_m: float) -> float:
    """Height of the surface below a pelvis at the point, m: the median of heights near near_m, or
    of all below the pelvis where there are none."""
    below = zone_heights(relief, np.array([point_m]), PELVIS, heading)[0]
    near = below[np.abs(below - near_m) < 2 * LEVEL_M]
    return float(np.median(near if len(near) * 2 > len(below) else below))

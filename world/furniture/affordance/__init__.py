"""Where one can sit and lie on a piece of furniture, found from its geometry alone."""

import numpy as np

from world.furniture.affordance.relief import Relief
from world.furniture.affordance.seats import LEVEL_M, PELVIS, seen


def level(relief: Relief, spot_m: tuple[float, float], heading: float, near_m: float) -> float:
    """Height that carries a pelvis at the spot, m: the median of what is about near_m high, or of
    everything below the pelvis where nothing is."""
    below = seen(relief, np.array([spot_m]), PELVIS, heading)[0]
    near = below[np.abs(below - near_m) < 2 * LEVEL_M]
    return float(np.median(near if len(near) * 2 > len(below) else below))

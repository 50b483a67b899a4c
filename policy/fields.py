"""Checked numbers of message fields; every error names the field and its valid form."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from policy.errors import RequestError

Numbers = NDArray[np.float64]
#: Bounds of positions, m, and velocities, m/s or rad/s; larger ones are a mistake of units.
FAR_M, FAST = 1e5, 1e3
#: Tolerances of a quaternion's length, and of |x| and |y| in the quaternion of upright furniture.
SLACK, TILT = 0.02, 0.02


def vector(values: Sequence[float], name: str, width: int, bound: float = FAR_M) -> Numbers:
    """Array [width] of a field; RequestError for another count, or numbers beyond ±bound."""
    if len(values) != width:
        raise RequestError(f"{name}: {len(values)} numbers, must be {width}")
    array = np.array(values, dtype=np.float64)
    if not (np.abs(array) <= bound).all():
        at = int(np.argmin(np.abs(array) <= bound))
        raise RequestError(f"{name}[{at}]: {array[at]}, must be within ±{bound:g}")
    return array


def number(value: float, name: str, low: float, high: float) -> float:
    """Number of a field; RequestError outside of [low, high]."""
    if not low <= value <= high:
        raise RequestError(f"{name}: {value}, must be {low:g} to {high:g}")
    return value


def quaternion(values: Sequence[float], name: str) -> Numbers:
    """Unit quaternion [4] of a field; RequestError where its length is not 1."""
    array = vector(values, name, 4, 2.0)
    length = float(np.linalg.norm(array))
    if abs(length - 1.0) > SLACK:
        raise RequestError(
            f"{name}: length {length:.3f}, must be a unit quaternion w, x, y, z (length 1)"
        )
    return array / length


def upright(values: Sequence[float], name: str) -> float:
    """Yaw, rad, of a field's rotation; RequestError where it is not about z."""
    w, x, y, z = quaternion(values, name)
    if max(abs(x), abs(y)) > TILT:
        raise RequestError(f"{name}: tilted ({w:.3f}, {x:.3f}, {y:.3f}, {z:.3f}), must be about z")
    return 2.0 * float(np.arctan2(z, w))

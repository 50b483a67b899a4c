"""Two-link inverse kinematics in closed form: a ball joint, a one-axis joint, an end point."""

import numpy as np

from world.motions.synthetic.rotations import Array, about

STRAIGHT = 0.9995
"""Greatest reach as a fraction of a limb's length: a target further away is not reached."""


def two_link(
    from_m: Array, to_m: Array, forward: Array, first_m: float, second_m: float, bend: int
) -> tuple[Array, Array]:
    """World rotation of the first link and angle of the one-axis joint that reach a point.

    At rest both links hang along -z and the joint's axis is y.

    Args:
        from_m: the ball joint, world, [T, 3].
        to_m: target of the second link's end, world, [T, 3].
        forward: a direction (need not be of unit length) that the limb's plane contains, [T, 3].
        first_m: length of the first link.
        second_m: length of the second link.
        bend: +1 for a knee (the joint moves forward, the second link turns by +y), -1 for an
            elbow (it moves backward, the second link turns by -y).

    Returns:
        rotation [T, 3, 3] of the first link in the world; signed angle [T] about its y axis.
    """
    up = from_m - to_m
    distance = np.linalg.norm(up, axis=-1)
    up = up / distance[:, None]
    distance = np.clip(distance, abs(first_m - second_m) + 0.02, STRAIGHT * (first_m + second_m))
    side = np.cross(up, forward)
    side /= np.linalg.norm(side, axis=-1, keepdims=True)
    frame = np.stack([np.cross(side, up), side, up], axis=-1)
    inner = (first_m**2 + second_m**2 - distance**2) / (2 * first_m * second_m)
    flexion = np.pi - np.arccos(np.clip(inner, -1, 1))
    lean = (first_m**2 + distance**2 - second_m**2) / (2 * first_m * distance)
    first = frame @ about("y", -bend * np.arccos(np.clip(lean, -1, 1)))
    return first, bend * flexion


def heading(yaw_rad: Array) -> Array:
    """Unit horizontal vectors [T, 3] at yaws [T]."""
    return np.stack([np.cos(yaw_rad), np.sin(yaw_rad), np.zeros_like(yaw_rad)], axis=-1)

"""A seated pose of the character, to let it down on furniture: in tests, benches and checks."""

import math

import numpy as np

from world import character
from world.furniture.piece import Place

#: Radius of the thighs' capsules, whose axes are level with the root when seated, m (humanoid.xml).
THIGH_M = 0.055
#: From knee to ankle, m.
SHIN_M = 0.41


#: Seats higher than this leave the feet hanging, m.
HANGING_M = 0.47


def angles_rad(height_m: float, knee_rad: float | None = None) -> dict[str, float]:
    """Flexion by kind of joint of one who sits height_m high, rad: arms forward over any armrest
    and the legs stretched as far as clears the floor and the front of a deep seat; on high seats,
    where no foot holds the balance, arms and shins hang. knee_rad: bend the knees so much instead.
    """
    if height_m > HANGING_M:
        return {"hip": -1.62, "knee": knee_rad or 1.5, "shoulder": -0.35, "elbow": -0.6}
    knee = math.asin(min(0.9, max(0.05, (height_m - 0.03) / SHIN_M)))
    return {
        "hip": -math.pi / 2,
        "knee": min(knee_rad or 1.1, knee),
        "shoulder": -1.3,
        "elbow": -0.2,
    }


def qpos(place: Place, above_m: float = 0.02, knee_rad: float | None = None) -> np.ndarray:
    """The character upright on a place, its thighs above_m above the surface: [43] float64, in the
    piece's frame."""
    q = character.standing_qpos()
    x, y, z = place.point_m
    yaw = place.facing_rad / 2
    q[:3] = x, y, z + THIGH_M + above_m
    q[3:7] = math.cos(yaw), 0.0, 0.0, math.sin(yaw)
    flexion, address = angles_rad(z, knee_rad), 7
    for joint in character.JOINTS:
        angle = flexion.get(joint.name.split("_")[-1], 0.0)
        if joint.is_ball:
            q[address : address + 4] = math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0
            address += 4
        else:
            q[address] = angle
            address += 1
    return q


def targets(place: Place, knee_rad: float | None = None) -> np.ndarray:
    """Servo targets that hold the pose: [28] rad."""
    flexion = angles_rad(place.point_m[2], knee_rad)
    result = []
    for joint in character.JOINTS:
        angle = flexion.get(joint.name.split("_")[-1], 0.0)
        result += [0.0, angle, 0.0] if joint.is_ball else [angle]
    return np.array(result)

"""Seated poses of the character for drop tests and benches."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from world.character import model as character
from world.furniture.piece import SeatTarget

#: Radius of the thighs' capsules, whose axes are level with the root when seated, m (humanoid.xml).
THIGH_M = 0.055
#: From knee to ankle, m.
SHIN_M = 0.41
#: On seats higher than this the feet hang, m.
HANGING_M = 0.47
#: Forearms across the belly: within the width of the trunk, and above armrests and thighs.
_ARMS = {"shoulder": -0.45, "elbow": 1.7}


@dataclass(frozen=True)
class Pose:
    """Parameters of a seated pose."""

    lean_rad: float = 0.0
    """Forward lean of the trunk above the hips."""
    knee_rad: float | None = None
    """Flexion of the knees; None: by the height of the seat."""


def poses() -> Iterator[Pose]:
    """Candidate poses: first the legs by the height of the seat, then tucked under a high seat's
    edge, then stretched over the front of a deep seat; each upright and leaning back."""
    for knee in (None, 1.9, 1.0, 0.6):
        for lean in (-0.15, -0.3, -0.45, 0.0):
            yield Pose(lean, knee)


def angles_rad(height_m: float, pose: Pose = Pose()) -> dict[str, float]:
    """Flexion, rad, by joint without its side, on a seat height_m high: the feet are on the floor,
    or the legs stretched to clear it; on high seats, where no foot supports, the shins hang."""
    low = height_m <= HANGING_M
    knee = math.asin(min(0.9, max(0.05, (height_m - 0.03) / SHIN_M))) if low else 1.5
    wanted = pose.knee_rad or (1.1 if low else 1.5)
    return {
        "abdomen": pose.lean_rad,
        "neck": -pose.lean_rad,
        "hip": -math.pi / 2 if low else -1.62,
        "knee": min(knee, wanted) if low else wanted,
        **_ARMS,
    }


def qpos(target: SeatTarget, above_m: float = 0.02, pose: Pose = Pose()) -> np.ndarray:
    """qpos [43] float64, piece's frame, of the character seated above a seat target, its thighs
    above_m above the surface."""
    q = character.standing_qpos()
    x, y, z = target.point_m
    yaw = target.facing_rad / 2
    q[:3] = x, y, z + THIGH_M + above_m
    q[3:7] = math.cos(yaw), 0.0, 0.0, math.sin(yaw)
    flexion, address = angles_rad(z, pose), 7
    for joint in character.JOINTS:
        angle = flexion.get(joint.name.split("_")[-1], 0.0)
        if joint.is_ball:
            q[address : address + 4] = math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0
            address += 4
        else:
            q[address] = angle
            address += 1
    return q


def set_points(target: SeatTarget, pose: Pose = Pose()) -> np.ndarray:
    """Set-points [28] rad that hold the pose."""
    flexion = angles_rad(target.point_m[2], pose)
    result = []
    for joint in character.JOINTS:
        angle = flexion.get(joint.name.split("_")[-1], 0.0)
        result += [0.0, angle, 0.0] if joint.is_ball else [angle]
    return np.array(result)

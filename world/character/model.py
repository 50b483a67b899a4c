"""The simulated human: skeleton, servos, set-point bounds and action 0, from humanoid.xml.

The servos are added here, in joint order, from one table: three per ball joint (for its rotation
vector), one per hinge. Source: the AMP humanoid of IsaacGymEnvs and ASE, method.md's table.
"""

from dataclasses import dataclass
from functools import cache
from importlib import resources

import mujoco
import numpy as np

import world.quiet  # noqa: F401  # pyright: ignore[reportUnusedImport]

CONTROL_HZ = 30
SUBSTEPS = 4
TIMESTEP_S = 1.0 / (CONTROL_HZ * SUBSTEPS)

BODIES = (
    "pelvis",
    "torso",
    "head",
    "right_upper_arm",
    "right_lower_arm",
    "right_hand",
    "left_upper_arm",
    "left_lower_arm",
    "left_hand",
    "right_thigh",
    "right_shin",
    "right_foot",
    "left_thigh",
    "left_shin",
    "left_foot",
)
PARENTS = (-1, 0, 1, 1, 3, 4, 1, 6, 7, 0, 9, 10, 0, 12, 13)
#: Body of each of the 12 joints, in qpos order.
JOINT_BODIES = (1, 2, 3, 4, 6, 7, 9, 10, 11, 12, 13, 14)
#: Left and right partner of each body (itself for the trunk).
MIRROR_BODIES = (0, 1, 2, 6, 7, 8, 3, 4, 5, 12, 13, 14, 9, 10, 11)


@dataclass(frozen=True)
class Joint:
    """One joint and the servos that drive it."""

    name: str
    kp: float
    """Position gain, N·m/rad."""
    kd: float
    """Velocity gain, N·m·s/rad."""
    limit_nm: float
    """Largest torque of each servo, N·m (see world.character.servos)."""
    range_deg: tuple[tuple[float, float], ...]
    """Bounds of the set-points: x, y, z of a ball joint's rotation vector, or a hinge's flexion."""

    @property
    def is_ball(self) -> bool:
        return len(self.range_deg) == 3


def _pair(
    name: str, kp: float, kd: float, limit: float, *ranges: tuple[float, float]
) -> list[Joint]:
    """A right joint and its left mirror image: x and z ranges change sign, y stays."""
    left = ranges
    if len(ranges) == 3:
        (x0, x1), y, (z0, z1) = ranges
        left = ((-x1, -x0), y, (-z1, -z0))
    return [
        Joint(f"right_{name}", kp, kd, limit, ranges),
        Joint(f"left_{name}", kp, kd, limit, left),
    ]


_SHOULDERS = _pair("shoulder", 400, 40, 100, (-180, 45), (-180, 60), (-90, 90))
_ELBOWS = _pair("elbow", 300, 30, 70, (0, 160))
_HIPS = _pair("hip", 500, 50, 200, (-60, 15), (-140, 60), (-60, 35))
_KNEES = _pair("knee", 500, 50, 150, (0, 160))
_ANKLES = _pair("ankle", 400, 40, 90, (-30, 30), (-55, 55), (-40, 40))

JOINTS: tuple[Joint, ...] = (
    Joint("abdomen", 1000, 100, 200, ((-60, 60), (-60, 90), (-50, 50))),
    Joint("neck", 100, 10, 50, ((-50, 50), (-40, 60), (-45, 45))),
    _SHOULDERS[0],
    _ELBOWS[0],
    _SHOULDERS[1],
    _ELBOWS[1],
    _HIPS[0],
    _KNEES[0],
    _ANKLES[0],
    _HIPS[1],
    _KNEES[1],
    _ANKLES[1],
)

NQ, NV, NU = 43, 34, 28


def _addresses() -> tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...], tuple[int, ...]]:
    """(qpos of balls, qpos of hinges, dof of balls' first axis, dof of hinges), from JOINTS."""
    q, v = 7, 6
    ball_q, hinge_q, ball_v, hinge_v = [], [], [], []
    for joint in JOINTS:
        if joint.is_ball:
            ball_q.append(q)
            ball_v.append(v)
            q, v = q + 4, v + 3
        else:
            hinge_q.append(q)
            hinge_v.append(v)
            q, v = q + 1, v + 1
    assert (q, v) == (NQ, NV)
    return tuple(ball_q), tuple(hinge_q), tuple(ball_v), tuple(hinge_v)


BALL_QPOS, HINGE_QPOS, BALL_DOF, HINGE_DOF = _addresses()

#: The joint of each control, and the controls of both arms.
_CONTROL_JOINTS = tuple(j.name for j in JOINTS for _ in range(3 if j.is_ball else 1))
ARM_CONTROLS = [
    k for k, name in enumerate(_CONTROL_JOINTS) if name.endswith(("_shoulder", "_elbow"))
]

#: Sign of each hinge about its body's y axis: elbows flex about −y, knees about +y.
HINGE_SIGN = tuple(-1.0 if "elbow" in j.name else 1.0 for j in JOINTS if not j.is_ball)


def set_point_bounds() -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper bound of the 28 set-points, rad: two arrays [28]."""
    ranges = np.array([r for joint in JOINTS for r in joint.range_deg], dtype=np.float64)
    return np.deg2rad(ranges[:, 0]), np.deg2rad(ranges[:, 1])


def gains() -> tuple[np.ndarray, np.ndarray]:
    """kp (N·m/rad) and kd (N·m·s/rad) of the 28 servos: two arrays [28]."""
    rows = [(j.kp, j.kd) for j in JOINTS for _ in j.range_deg]
    return np.array([r[0] for r in rows]), np.array([r[1] for r in rows])


def effort_limits() -> np.ndarray:
    """Largest torques of the 28 servos, N·m: [28]."""
    return np.array([joint.limit_nm for joint in JOINTS for _ in joint.range_deg], dtype=np.float64)


def spec() -> mujoco.MjSpec:
    """A new MjSpec of the character alone with its servos, for any simulator: set-points bounded by
    ctrlrange, torques by forcerange."""
    return _parsed().copy()


@cache
def _parsed() -> mujoco.MjSpec:
    """The spec to copy: a training compiles hundreds, and the text takes as long as all else."""
    text = resources.files("world.character").joinpath("humanoid.xml").read_text()
    result = mujoco.MjSpec.from_string(text)
    for joint in JOINTS:
        for axis, (low, high) in enumerate(joint.range_deg):
            suffix = f"_{'xyz'[axis]}" if joint.is_ball else ""
            gear = np.zeros(6)
            gear[axis] = 1.0
            servo = result.add_actuator(
                name=joint.name + suffix,
                trntype=mujoco.mjtTrn.mjTRN_JOINT,
                target=joint.name,
                gear=gear,
                ctrllimited=True,
                ctrlrange=np.deg2rad([low, high]),
                forcelimited=True,
                forcerange=[-joint.limit_nm, joint.limit_nm],
            )
            servo.set_to_position(kp=joint.kp, kv=joint.kd)
    return result


#: Set-points of action 0, rad: about the mean pose of walking and sitting people (upper limbs
#: relaxed, legs half-way between standing and sitting). A constant, so that actions are the same
#: for every policy.
_NEUTRAL_RAD = {
    "abdomen": (0.0, 0.3, 0.0),
    "neck": (0.0, 0.05, 0.0),
    "right_shoulder": (-0.4, 0.0, 0.25),
    "left_shoulder": (0.4, 0.0, -0.25),
    "right_elbow": (0.7,),
    "left_elbow": (0.7,),
    "right_hip": (-0.05, -0.4, -0.15),
    "left_hip": (0.05, -0.4, 0.15),
    "right_knee": (0.7,),
    "left_knee": (0.7,),
    "right_ankle": (0.1, 0.0, -0.15),
    "left_ankle": (-0.1, 0.0, 0.15),
}


def neutral_set_points() -> np.ndarray:
    """Set-points of action 0, rad: [28]."""
    return np.array([angle for joint in JOINTS for angle in _NEUTRAL_RAD[joint.name]])


def standing_qpos() -> np.ndarray:
    """A relaxed stand on flat feet, arms hanging, at the origin facing +x: qpos [43] float64."""
    q = np.zeros(NQ)
    q[3] = 1.0
    q[list(BALL_QPOS)] = 1.0
    angles = {"hip": -0.10, "knee": 0.20, "ankle": -0.10}
    address = 7
    for joint in JOINTS:
        side = joint.name.split("_")[-1]
        if joint.is_ball:
            half = 0.5 * angles.get(side, 0.0)
            q[address], q[address + 2] = np.cos(half), np.sin(half)
            address += 4
        else:
            q[address] = angles.get(side, 0.15)
            address += 1
    # thigh 0.421546 tilted 0.10, shin 0.40987 tilted back 0.10, sole 0.05 below the ankle
    q[2] = (0.421546 + 0.40987) * np.cos(0.10) + 0.05
    return q

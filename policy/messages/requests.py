"""Conversion of messages to rows of numbers; every error names the field and its valid form."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from policy.errors import RequestError
from policy.fields import FAST, SLACK, Numbers, quaternion, vector
from policy.objects import adapter, require
from policy.objects.columns import COLUMNS, POSE_WIDTH
from rpc.v1 import policy_pb2 as pb
from world.character import model as character
from world.tasks import Task

JOINT_POSITIONS = character.NQ - 7
_BALLS = [address - 7 for address in character.BALL_QPOS]


def _turned_back(q: Numbers, v: Numbers) -> Numbers:
    """World vector v [3] in the axes of rotation q [4]."""
    w, u = q[0], -q[1:]
    across: Numbers = np.asarray(np.cross(u, v), dtype=np.float64)
    return v + 2.0 * np.asarray(np.cross(u, across + w * v), dtype=np.float64)


def coordinates(pose: pb.Pose, name: str) -> tuple[Numbers, Numbers]:
    """MuJoCo's qpos [43] and qvel [34] of a pose; RequestError names a wrong field."""
    rotation = quaternion(pose.root_rotation, f"{name}.root_rotation")
    joints = vector(
        pose.joint_position, f"{name}.joint_position", JOINT_POSITIONS, 4.0 * np.pi
    ).copy()
    for address in _BALLS:
        length = float(np.linalg.norm(joints[address : address + 4]))
        if abs(length - 1.0) > SLACK:
            raise RequestError(
                f"{name}.joint_position[{address}:{address + 4}]: length {length:.3f}, must be a "
                "unit quaternion w, x, y, z (see Describe for the order of the joints)"
            )
        joints[address : address + 4] /= length
    position = vector(pose.root_position, f"{name}.root_position", 3)
    spin = vector(pose.root_angular_velocity, f"{name}.root_angular_velocity", 3, FAST)
    velocity = vector(pose.root_velocity, f"{name}.root_velocity", 3, FAST)
    turning = vector(pose.joint_velocity, f"{name}.joint_velocity", character.NV - 6, FAST)
    return (
        np.concatenate((position, rotation, joints)),
        np.concatenate((velocity, _turned_back(rotation, spin), turning)),
    )


_WORLD_POINTS = [
    COLUMNS[name].start + 3 * i
    for name, count in (
        ("qpos", 1), ("point", 1), ("corners", 8), ("head", 1),
        ("box_position", 1), ("box_start", 1), ("box_target", 1),
    )
    for i in range(count)
]  # fmt: skip


def pose(message: pb.Situation, task: Task, name: str) -> Numbers:
    """Return a pose request as a row [POSE_WIDTH], float64, horizontally relative to the
    root."""
    row = np.zeros(POSE_WIDTH)
    if not message.HasField("pose"):
        raise RequestError(f"{name}.pose: missing")
    row[COLUMNS["qpos"]], row[COLUMNS["qvel"]] = coordinates(message.pose, f"{name}.pose")
    require(message, task, f"{name}.")
    adapter(task).fill(row, message, task, name)
    # relative, because float32 would lose centimetres at large coordinates
    x, y = row[:2].copy()
    for start in _WORLD_POINTS:
        row[start] -= x
        row[start + 1] -= y
    return row


def poses(messages: Sequence[pb.Situation], task: Task, first: int = 0) -> tuple[bytes, int]:
    """Return the rows [n, POSE_WIDTH] float32 of pose requests, as bytes, and n; `first`: number of
    the first."""
    rows = [pose(m, task, f"situations[{i}]") for i, m in enumerate(messages, first)]
    return np.stack(rows).astype("<f4").tobytes(), len(rows)


def observation(
    state: bytes, goal: bytes, widths: tuple[int, int], limit: int
) -> tuple[bytes, int]:
    """Observation rows (state, goal) [n, width] float32, as bytes, and n."""
    state_width, goal_width = widths
    rows, rest = divmod(len(state), 4 * state_width)
    if rest:
        raise RequestError(
            f"state: {len(state)} bytes, must be a multiple of {4 * state_width} "
            f"({state_width} float32 a row; see Describe)"
        )
    count(rows, "state", limit)
    if len(goal) != 4 * goal_width * rows:
        raise RequestError(
            f"goal: {len(goal)} bytes, must be {4 * goal_width * rows} ({rows} rows, as state has, "
            f"of {goal_width} float32; see Describe)"
        )
    if rows == 1:
        return state + goal, 1
    both = (np.frombuffer(state, "<f4").reshape(rows, -1), np.frombuffer(goal, "<f4"))
    return np.concatenate((both[0], both[1].reshape(rows, -1)), axis=1).tobytes(), rows


def noise(seed: int, counter: int, rows: int) -> NDArray[np.float32]:
    """Standard normal numbers [rows, 28], a function of seed and counter."""
    draw = np.random.Generator(np.random.Philox(key=seed, counter=[0, 0, 0, counter]))
    return draw.standard_normal((rows, character.NU), dtype=np.float32)


def count(rows: int, name: str, limit: int) -> None:
    """Raise RequestError unless there are 1 to `limit` rows; to be called before they are read."""
    if not 1 <= rows <= limit:
        raise RequestError(f"{name}: {rows} rows, must be 1 to {limit}")

"""Inverse kinematics with mink: the pose of each frame that follows the targets within the limits.

Each frame is solved alone, from the pose of its own targets: the result is as smooth as the targets
are.
"""

from functools import cache

import mink
import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from world.character import model as character
from world.motions.clip import generalised_positions
from world.motions.retarget.body import Array, Targets, generalised
from world.motions.retarget.limits import AboveFloor, JointRanges

#: Weights of the targets, per m of position and per rad of rotation.
_POSITION = {"pelvis": 3.0, "hand": 6.0, "foot": 12.0}
_ROTATION = {
    "pelvis": 1.5,
    "torso": 1.0,
    "head": 0.4,
    "upper_arm": 0.25,
    "lower_arm": 0.0,
    "hand": 0.0,
    "thigh": 0.4,
    "shin": 0.0,
    "foot": 2.5,
}
#: Steps per frame: after the fourth all bodies are within 2 mm of the converged solution.
_STEPS = 4
#: Greatest number of steps, for a frame whose last step is more than the second value, rad or m.
_MOST_STEPS, _SETTLED = 12, 0.02
#: Greatest turn of a joint in a step, rad: the limits are linearised.
_LONGEST = 0.5
#: Damping, which keeps a straight arm out of reach from alternating between two elbow poses.
_DAMPING = 0.03


@cache
def _model() -> mujoco.MjModel:
    return character.spec().compile()


def _tasks(model: mujoco.MjModel) -> list[tuple[int, mink.FrameTask]]:
    tasks = []
    for index, body in enumerate(character.BODIES):
        kind = body.removeprefix("right_").removeprefix("left_")
        position, rotation = _POSITION.get(kind, 0.0), _ROTATION[kind]
        if position or rotation:
            tasks.append((index, mink.FrameTask(body, "body", position, rotation, lm_damping=1e-4)))
    return tasks


def solved(target: Targets) -> tuple[Array, Array]:
    """Root positions [T, 3] m and local rotations [T, 15, 4] (w, x, y, z) that meet the targets."""
    model = _model()
    configuration = mink.Configuration(model)
    tasks = _tasks(model)
    limits = [JointRanges(), AboveFloor(model)]
    local, root = generalised(target)
    start = generalised_positions(root.astype(np.float32), local.astype(np.float32))
    start = within_ranges(start.astype(np.float64))
    quaternion = Rotation.from_matrix(target.rotation.reshape(-1, 3, 3)).as_quat(scalar_first=True)
    quaternion = quaternion.reshape(-1, 15, 4)
    position = _positions(target)
    result = np.empty_like(start)
    for frame, qpos in enumerate(start):
        configuration.update(qpos)
        for body, task in tasks:
            task.set_target(
                mink.SE3(np.concatenate((quaternion[frame, body], position[frame, body])))
            )
        for step in range(_MOST_STEPS):
            move = _step(configuration, [t for _, t in tasks], limits)
            size = np.abs(move).max()
            configuration.integrate_inplace(move * min(1.0, _LONGEST / max(size, 1e-9)), 1)
            if step + 1 >= _STEPS and size < _SETTLED:
                break
        result[frame] = configuration.q
    return result[:, :3].astype(np.float32), local_of(result)


def _step(
    configuration: mink.Configuration, tasks: list[mink.FrameTask], limits: list[mink.Limit]
) -> Array:
    """One step of the inverse kinematics, dq [34]; limits are violated only where they conflict."""
    try:
        return _solve(configuration, tasks, limits)
    except mink.NoSolutionFound:
        return _solve(configuration, tasks, limits[:1])


def _solve(
    configuration: mink.Configuration, tasks: list[mink.FrameTask], limits: list[mink.Limit]
) -> Array:
    return mink.solve_ik(configuration, tasks, 1.0, "daqp", damping=_DAMPING, limits=limits)


def _positions(target: Targets) -> Array:
    """Target positions [T, 15, 3] of the bodies that have one; 0 elsewhere."""
    position = np.zeros((len(target.root), 15, 3))
    position[:, 0] = target.root
    position[:, [5, 8]] = target.hand
    position[:, [11, 14]] = target.ankle
    return position


def within_ranges(qpos: Array) -> Array:
    """qpos [T, 43] with each joint's axes clipped to the bounds of its servos."""
    low, high = character.set_point_bounds()
    qpos, row = qpos.copy(), 0
    address = 7
    for joint in character.JOINTS:
        if joint.is_ball:
            vector = Rotation.from_quat(qpos[:, address : address + 4], scalar_first=True)
            clipped = np.clip(vector.as_rotvec(), low[row : row + 3], high[row : row + 3])
            qpos[:, address : address + 4] = Rotation.from_rotvec(clipped).as_quat(
                scalar_first=True
            )
            row, address = row + 3, address + 4
        else:
            qpos[:, address] = np.clip(qpos[:, address], low[row], high[row])
            row, address = row + 1, address + 1
    return qpos


def local_of(qpos: Array) -> Array:
    """Local rotations [T, 15, 4] float32 of qpos [T, 43]."""
    import torch

    from world.character import kinematics

    return kinematics.local_rotations(torch.from_numpy(qpos.astype(np.float32))).numpy()

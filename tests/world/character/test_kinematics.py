"""Forward kinematics against MuJoCo's, at random poses."""

import mujoco
import numpy as np
import torch

from world import rotations
from world.character import kinematics
from world.character import model as character


def random_poses(n: int) -> torch.Tensor:
    draw = np.random.default_rng(0)
    qpos = np.tile(character.standing_qpos(), (n, 1))
    qpos[:, :3] += draw.normal(size=(n, 3))
    for start in (3, *character.BALL_QPOS):
        quat = draw.normal(size=(n, 4))
        qpos[:, start : start + 4] = quat / np.linalg.norm(quat, axis=1, keepdims=True)
    for address in character.HINGE_QPOS:
        qpos[:, address] = draw.uniform(-2.0, 2.0, n)
    return torch.from_numpy(qpos)


def test_bodies_are_where_mujoco_has_them() -> None:
    qpos = random_poses(20)
    local = rotations.matrix(kinematics.local_rotations(qpos))
    position, rotation = kinematics.forward(qpos[:, :3], local)
    model = character.spec().compile()
    data = mujoco.MjData(model)
    for row, pose in enumerate(qpos.numpy()):
        data.qpos[:] = pose
        mujoco.mj_kinematics(model, data)
        np.testing.assert_allclose(position[row], data.xpos[1:], atol=1e-6)
        np.testing.assert_allclose(rotation[row].reshape(15, 9), data.xmat[1:], atol=1e-6)


def test_offsets_are_the_models() -> None:
    model = character.spec().compile()
    found = kinematics.offsets()
    np.testing.assert_allclose(found[1:], model.body_pos[2:], atol=1e-7)
    assert not found[0].any()


def test_what_a_pose_is_differentiated_by_reaches_the_hands() -> None:
    qpos = random_poses(1).requires_grad_()
    position, _ = kinematics.forward(
        qpos[:, :3], rotations.matrix(kinematics.local_rotations(qpos))
    )
    (gradient,) = torch.autograd.grad(position[0, 5, 2], qpos)
    assert gradient[0, 2] == 1.0 and gradient.isfinite().all() and gradient[0, 3:].abs().max() > 0

"""Poses from kept coordinates, against MuJoCo, and headings."""

import mujoco
import numpy as np
import pytest

from console.play.source import Poser, heading
from world.character import model as character
from world.furniture.catalogue import find
from world.scene.model import Ball, compile_scene


def test_poses_are_the_simulators() -> None:
    model = compile_scene(find("chair-train-000"), [Ball()])
    qpos = character.standing_qpos()
    qpos[:2] = 1.0, -2.0
    place, turn = np.array([[3.0, 1.0, 0.0]]), np.array([[0.6, 0.0, 0.0, 0.8]])
    balls = np.array([[0.1, 0.2, 0.3]])
    found = Poser(model).poses(qpos, place, turn, balls)
    data = mujoco.MjData(model)
    data.qpos[: len(qpos)] = qpos
    data.mocap_pos[:], data.mocap_quat[:] = place, turn
    mujoco.mj_kinematics(model, data)
    body = model.body("left_foot").id
    np.testing.assert_allclose(found[body, :3], data.xpos[body])
    np.testing.assert_allclose(found[body, 3:], data.xquat[body])
    assert found[model.body("furniture").id].tolist() == pytest.approx([3, 1, 0, 0.6, 0, 0, 0.8])
    assert found[model.body("projectile0").id, :3].tolist() == [0.1, 0.2, 0.3]


@pytest.mark.parametrize("yaw", [-3.0, -1.0, 0.0, 2.0])
def test_headings(yaw: float) -> None:
    qpos = character.standing_qpos()
    # leaning forwards does not change where one looks
    lean, half = 0.2, yaw / 2
    qpos[3:7] = (
        np.cos(half) * np.cos(lean), -np.sin(half) * np.sin(lean),
        np.cos(half) * np.sin(lean), np.sin(half) * np.cos(lean),
    )  # fmt: skip
    assert heading(qpos) == pytest.approx(yaw)

"""The servos' effort: against MuJoCo's own forces, and random actions for as long as it takes."""

import mujoco
import numpy as np
import pytest
import torch

from world import random_streams
from world.character import model as character
from world.character import servos
from world.scene import model as scene
from world.scene.batch import Scenes

LIMITS = character.effort_limits()


def states(n: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Random qpos [n, 43], balls turned by up to three radians, and qvel [n, 34]."""
    draw = np.random.default_rng(5)
    qpos = np.tile(character.standing_qpos(), (n, 1))
    for address in character.BALL_QPOS:
        axis = draw.normal(size=(n, 3))
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        half = draw.uniform(0, 1.5, size=(n, 1))
        # either sign of the quaternion is the same rotation
        sign = draw.choice([-1.0, 1.0], size=(n, 1))
        qpos[:, address : address + 4] = sign * np.hstack([np.cos(half), np.sin(half) * axis])
    qpos[:, list(character.HINGE_QPOS)] = draw.uniform(0, 2.5, size=(n, 4))
    return torch.from_numpy(qpos), torch.from_numpy(draw.normal(size=(n, 34)) * 4)


@pytest.fixture(scope="module")
def unlimited() -> mujoco.MjModel:
    model = character.spec().compile()
    model.actuator_forcelimited[:] = 0
    model.actuator_ctrllimited[:] = 0
    return model


def test_limited_targets_pull_with_the_limit(unlimited: mujoco.MjModel) -> None:
    """In MuJoCo: kp (target - length) - kd velocity, cut to the table's torques."""
    qpos, qvel = states(20)
    low, high = character.set_point_bounds()
    wanted = torch.from_numpy(np.random.default_rng(6).uniform(low, high, size=(20, 28)))
    given = servos.limited(wanted, qpos, qvel)
    kp, kd = character.gains()
    strained = 0
    data = mujoco.MjData(unlimited)
    for row in range(20):
        data.qpos[:], data.qvel[:], data.ctrl[:] = qpos[row], qvel[row], given[row]
        mujoco.mj_forward(unlimited, data)
        np.testing.assert_allclose(servos.coordinates(qpos)[row], data.actuator_length, atol=1e-9)
        force = kp * (wanted[row].numpy() - data.actuator_length) - kd * data.actuator_velocity
        held = np.clip(force, -LIMITS, LIMITS)
        np.testing.assert_allclose(data.actuator_force, held, atol=1e-6)
        within = np.abs(force) < LIMITS
        np.testing.assert_array_equal(given[row][within], wanted[row][within])
        strained += (~within).sum()
    assert 100 < strained < 20 * 28


def test_random_actions_stay_finite() -> None:
    """Ten seconds of random actions in each of 256 scenes, nobody set back on their feet.

    Ten minutes in each: `inhabit bench servos --scenes 256 --seconds 3600`.
    """
    scenes = Scenes([scene.compile_scene(None)] * 256, 0.35, 3.0, threads=2)
    qpos = torch.from_numpy(character.standing_qpos()).expand(256, -1)
    ids, still = torch.arange(256), torch.zeros(256, 34)
    here = torch.tensor([[1.0, 0.0]]).expand(256, -1)
    scenes.set_state(ids, qpos, still, torch.zeros(256, 3), here)
    fastest = 0.0
    for step in range(300):
        scenes.act(6.0 * random_streams.uniform(0, 99, ids, step, character.NU) - 3.0)
        assert scenes.finite().all()
        fastest = max(fastest, float(scenes.qvel.abs().max()))
    assert scenes.batch.warning[..., 1].sum() == 0
    # before the effort was limited where servos are told: 100 and more within three seconds
    assert 5.0 < fastest < 60.0

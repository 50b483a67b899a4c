"""The helping hand: it rights a lying character within its bounds, and waits for its own path."""

import math

import numpy as np
import pytest
import torch

from console.demo.hoist import STANDING_M, Hoist
from console.kinds.poses import HERE
from world.character import model as character
from world.character import servos
from world.scene.batch import Scenes
from world.scene.model import compile_scene

STAND = servos.coordinates(torch.from_numpy(character.standing_qpos())[None])
STEP_S = 1 / character.CONTROL_HZ
WEIGHT_N = 9.81 * character.spec().compile().body_mass.sum()


def lying(axis: tuple[float, float, float], angle: float) -> Scenes:
    scenes = Scenes([compile_scene(None)], 0.35, 3.0)
    qpos = character.standing_qpos()
    qpos[2] = 0.3
    qpos[3:7] = math.cos(angle / 2), *(math.sin(angle / 2) * x for x in axis)
    scenes.set_state(
        HERE,
        torch.from_numpy(qpos)[None],
        torch.zeros(1, character.NV),
        torch.zeros(1, 3),
        torch.tensor([[1.0, 0.0]]),
    )
    return scenes


@pytest.mark.parametrize(
    ("axis", "angle"),
    [((0.0, 1.0, 0.0), -1.57), ((0.0, 1.0, 0.0), 1.57), ((1.0, 0.0, 0.0), 1.57)],
    ids=["on its back", "on its front", "on its side"],
)
def test_it_brings_a_lying_character_to_its_feet(
    axis: tuple[float, float, float], angle: float
) -> None:
    scenes, yaw = lying(axis, angle), 2.0
    force = scenes.batch.bind("xfrc_applied")
    hoist = Hoist([np.array([0.0, 0.0, 1.0]), np.array([0.5, 0.2, STANDING_M])], yaw)
    largest = 0.0
    for _ in range(300):
        if hoist.done:
            break
        wrench = hoist.wrench(scenes.qpos[0].numpy(), scenes.qvel[0].numpy(), STEP_S)
        largest = max(largest, float(np.linalg.norm(wrench[:3])))
        force[0, 1] = wrench
        scenes.drive(STAND)
    assert hoist.done
    qpos = scenes.qpos[0].numpy()
    assert np.linalg.norm(qpos[:3] - [0.5, 0.2, STANDING_M]) < 0.15
    heading = scenes.body().heading[0].numpy()
    assert heading @ [math.cos(yaw), math.sin(yaw)] > 0.97
    assert WEIGHT_N / 2 < largest <= 3 * WEIGHT_N + 1e-6


def test_its_wrench_by_hand() -> None:
    qpos = character.standing_qpos()
    hoist = Hoist([np.array([0.0, 0.0, STANDING_M])], 0.0)
    # at the end, upright and at rest: it carries the weight, no torque
    wrench = hoist.wrench(qpos, np.zeros(character.NV), STEP_S)
    assert wrench[:2] == pytest.approx([0.0, 0.0]) and wrench[3:] == pytest.approx([0.0] * 3)
    assert 0.85 * WEIGHT_N < wrench[2] <= WEIGHT_N  # one step of ten has passed in which it lets go
    # 10 cm to the side: 45 kg · 36 / s² · 0.1 m back
    aside = qpos.copy()
    aside[1] += 0.1
    assert hoist.wrench(aside, np.zeros(character.NV), STEP_S)[1] == pytest.approx(
        -WEIGHT_N / 9.81 * 36 * 0.1, rel=1e-6
    )


def test_it_waits_for_a_character_that_is_held() -> None:
    """The reference does not run ahead: it goes on from higher after a while."""
    qpos, far = character.standing_qpos(), np.array([5.0, 0.0, STANDING_M])
    hoist = Hoist([far, far], 0.0)
    pulls = [hoist.wrench(qpos, np.zeros(character.NV), STEP_S) for _ in range(75)]
    ahead = [pull[0] / (WEIGHT_N / 9.81 * 36) for pull in pulls]
    assert max(ahead) < 0.35 and not hoist.done
    assert pulls[-1][2] > 1.3 * WEIGHT_N, "it lifts what holds the legs"

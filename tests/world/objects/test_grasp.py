"""The scripted grip: inverse kinematics against forward kinematics, forces against MuJoCo's
Jacobian, and a box that it lifts, carries over and sets down."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
import torch

from world import rotations
from world.character import kinematics, servos
from world.character import model as character
from world.objects import grasp
from world.objects.box_bank import BoxBank, Layout, resting
from world.scene.batch import Scenes
from world.scene.box import box
from world.scene.target import Target
from world.tasks.carry import Carry, grips

RIGHT, LEFT = grasp._SIDES


def test_matrices_and_quaternions_are_inverse() -> None:
    q = rotations.normalise(
        torch.randn(500, 4, generator=torch.Generator().manual_seed(0)).double()
    )
    # half turns, where the real part is 0
    q = torch.cat((q, torch.eye(4, dtype=torch.float64)))
    back = rotations.from_matrix(rotations.matrix(q))
    torch.testing.assert_close((back * q).sum(dim=1).abs(), torch.ones(len(q), dtype=torch.float64))


def pose(shoulder: np.ndarray, elbow: float) -> torch.Tensor:
    """Standing, the right arm at this rotation vector and angle: qpos [1, 43]."""
    qpos = character.standing_qpos()
    angle = np.linalg.norm(shoulder)
    address = character.BALL_QPOS[2]
    qpos[address] = np.cos(angle / 2)
    qpos[address + 1 : address + 4] = np.sin(angle / 2) * shoulder / angle
    qpos[character.HINGE_QPOS[0]] = elbow
    return torch.from_numpy(qpos).float()[None]


def forward(qpos: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    local = rotations.matrix(kinematics.local_rotations(qpos))
    return kinematics.forward(qpos[:, :3], local)


@pytest.mark.parametrize("pitch", [-1.4, -0.9, -0.4])
def test_the_arm_reaches_where_it_should(pitch: float) -> None:
    upper, lower, hand, _ = RIGHT
    position, rotation = forward(pose(np.array([-0.3, pitch, 0.2]), 1.0))
    goal = position[:, hand] + torch.tensor([[-0.05, 0.03, 0.06]])
    angles = grasp._reach(position, rotation, goal, -1.0, upper, lower)[0]
    reached, _ = forward(pose(angles[:3].numpy(), float(angles[3])))
    torch.testing.assert_close(reached[:, hand], goal, atol=1e-5, rtol=0)


def test_a_hand_that_is_there_is_told_to_stay() -> None:
    """But for the elbow, which sinks: turned at once it would push the hand."""
    upper, lower, hand, first = RIGHT
    qpos = pose(np.array([-0.35, -0.9, 0.2]), 1.0)
    position, rotation = forward(qpos)
    angles = grasp._reach(position, rotation, position[:, hand], -1.0, upper, lower)
    here = servos.coordinates(qpos)[:, first : first + 4]
    assert (angles - here).abs().max() < 0.05


def test_the_pull_is_the_force_by_the_jacobian() -> None:
    upper, lower, hand, first = RIGHT
    qpos = pose(np.array([-0.35, -0.9, 0.2]), 1.0)
    force = torch.tensor([[10.0, 75.0, 20.0]])
    pull = grasp._pull(*forward(qpos), force, upper, lower, hand)[0].numpy()
    model = character.spec().compile()
    data = mujoco.MjData(model)
    data.qpos[:] = qpos[0].numpy()
    mujoco.mj_forward(model, data)
    jacobian = np.zeros((3, model.nv))
    mujoco.mj_jacBody(model, data, jacobian, None, model.body("right_hand").id)
    moments = jacobian[:, 6 + first : 10 + first].T @ force[0].numpy()
    kp = character.gains()[0][first : first + 4]
    np.testing.assert_allclose(pull * kp, moments, atol=1e-3)


def scene(height: float, target: tuple[float, float]) -> tuple[Scenes, BoxBank, Target, Layout]:
    """A box of 4 kg before a character whose pelvis nothing moves; gravity pulls at the box
    alone."""
    bank = BoxBank([box(1.0)])
    model = bank.models[0]
    model.opt.gravity[:] = 0.0
    model.body_mass[1], model.body_inertia[1] = 1e3, 1e2
    scenes = Scenes([model], 0.35, 3.0)
    at = torch.tensor([[0.36, 0.0, height]])
    end = torch.tensor([[target[0], 0.0, target[1]]])
    layout = resting(at, torch.tensor([[1.0, 0.0]]), end)
    layout = replace(layout, position=at + torch.tensor([0.0, 0.0, 0.001]))
    here = torch.zeros(1, dtype=torch.int64)
    standing = torch.from_numpy(character.standing_qpos()).float()[None]
    scenes.set_down(here, standing, torch.zeros(1, 34), layout.start, layout.start_yaw)
    bank.put(scenes, here, here, layout)
    weight = scenes.batch.bind("xfrc_applied")
    weight[:, model.body("box").id, 2] = -9.81 * float(bank.mass[0])
    return scenes, bank, bank.target(here, layout), layout


def play(scenes: Scenes, bank: BoxBank, place: Target, steps: int) -> list[Target]:
    """The arms and the bend of the trunk are led; where the box went."""
    root = scenes.qpos[:, :7].clone()
    bent = servos.coordinates(torch.from_numpy(character.standing_qpos())[None]).float()
    path = []
    for _ in range(steps):
        now = scenes.now(place)
        wanted, said = grasp.lead(scenes.qpos.float(), now, bank.mass[:1])
        scenes.drive(torch.where(said, wanted, bent).double())
        scenes.qpos[:, :7], scenes.qvel[:, :6] = root, 0.0
        path.append(scenes.now(place))
    return path


def test_it_lifts_a_box_and_holds_it_before_the_body() -> None:
    scenes, bank, place, _ = scene(0.8, (5.0, 0.9))
    path = play(scenes, bank, place, 220)
    end = path[-1].box
    assert end is not None
    assert grips(scenes.body(), end).item()
    assert end.position[0, 2].item() == pytest.approx(0.893 + 0.12, abs=0.04)
    assert end.velocity.norm() < 0.05


def test_the_trunk_bends_for_a_low_box_and_comes_up_with_it() -> None:
    scenes, bank, place, _ = scene(0.74, (5.0, 0.9))
    bends = []
    for _ in range(12):
        play(scenes, bank, place, 20)
        bends.append(float(servos.coordinates(scenes.qpos)[0, 1]))
    end = scenes.now(place).box
    assert end is not None
    assert max(bends) > 0.5
    assert bends[-1] < 0.5 * max(bends)
    assert end.position[0, 2] > 0.9


def test_it_sets_a_box_down_and_lets_go() -> None:
    scenes, bank, place, layout = scene(0.8, (0.36, 0.92))
    # the target's stand is higher than the start's and at the same place: up, and put down there
    path = play(scenes, bank, place, 150)
    end = path[-1].box
    assert end is not None
    assert (end.position - layout.target)[0, 2].abs() < 0.03
    assert Carry().error_m(scenes.body(), path[-1]).item() < 0.1


def test_out_of_reach_the_arms_are_left_alone() -> None:
    scenes, bank, place, _ = scene(0.8, (5.0, 0.9))
    qpos = scenes.qpos.float()
    _, said = grasp.lead(qpos, scenes.now(place), bank.mass[:1])
    # the arms, and the bend of the trunk
    assert said[0].nonzero().flatten().tolist() == [1, *range(6, 14)]
    qpos[0, 0] -= 1.0
    _, said = grasp.lead(qpos, scenes.now(place), bank.mass[:1])
    assert not said.any()

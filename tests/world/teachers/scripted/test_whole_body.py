"""The whole body: Jacobians against MuJoCo's, the least squares against its closed form, and a
squat that keeps its balance in the physics."""

import mujoco
import numpy as np
import pytest
import torch
from torch import Tensor

from world import rotations
from world.character import model as character
from world.scene.batch import Scenes
from world.scene.model import compile_scene
from world.teachers.scripted import motion as mover
from world.teachers.scripted.gait import Footing, Gait, unit
from world.teachers.scripted.motion import HANDS, Pace, Reach
from world.teachers.scripted.whole_body import (
    BODY_KG,
    GRAVITY_M_S2,
    Figure,
    Load,
    Mass,
    Tasks,
    attitude,
    moments,
    rotation_error,
    set_points,
)


@pytest.fixture(autouse=True)
def one_thread() -> None:
    torch.set_num_threads(1)


def random_states(n: int) -> tuple[Tensor, Tensor]:
    """qpos [n, 43] and qvel [n, 34] anywhere, every joint bent."""
    generator = torch.Generator().manual_seed(0)
    qpos = torch.randn(n, character.NQ, generator=generator, dtype=torch.float64)
    for address in (3, *character.BALL_QPOS):
        qpos[:, address : address + 4] = rotations.normalise(qpos[:, address : address + 4])
    return qpos, torch.randn(n, character.NV, generator=generator, dtype=torch.float64)


def in_mujoco(qpos: Tensor, qvel: Tensor) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = character.spec().compile()
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = qpos.numpy(), qvel.numpy()
    mujoco.mj_forward(model, data)
    return model, data


def about_the_world(jacobian: np.ndarray, figure: Figure, scene: int) -> np.ndarray:
    """MuJoCo's, whose root turns about its own axes, in our columns."""
    found = jacobian.copy()
    found[:, 3:6] = jacobian[:, 3:6] @ figure.rotation[scene, 0].numpy().T
    return found


@pytest.mark.parametrize("name", ["pelvis", "torso", "left_hand", "right_lower_arm", "right_foot"])
def test_the_jacobians_of_bodies_are_mujocos(name: str) -> None:
    qpos, qvel = random_states(3)
    figure, body = Figure.of(qpos, qvel), character.BODIES.index(name)
    for scene in range(3):
        model, data = in_mujoco(qpos[scene], qvel[scene])
        place, turn, corner = (np.zeros((3, model.nv)) for _ in range(3))
        index = model.body(name).id
        mujoco.mj_jacBody(model, data, place, turn, index)
        point = data.xpos[index] + np.array([0.1, -0.2, 0.3])
        mujoco.mj_jac(model, data, corner, None, point, index)
        there = torch.from_numpy(point)[None].expand(3, 3)
        for theirs, ours in (
            (place, figure.point_jacobian(body)),
            (turn, figure.turning_jacobian(body)),
            (corner, figure.point_jacobian(body, there)),
        ):
            expected = about_the_world(theirs, figure, scene)
            # body offsets are kept in float32
            np.testing.assert_allclose(ours[scene], expected, atol=1e-6)
        velocity = (figure.point_jacobian(body) @ figure.velocity[..., None])[scene, :, 0]
        np.testing.assert_allclose(velocity, place @ data.qvel, atol=1e-5)


def test_the_centre_of_mass_and_its_jacobian_are_mujocos() -> None:
    qpos, qvel = random_states(3)
    figure = Figure.of(qpos, qvel)
    for scene in range(3):
        model, data = in_mujoco(qpos[scene], qvel[scene])
        jacobian = np.zeros((3, model.nv))
        mujoco.mj_jacSubtreeCom(model, data, jacobian, 1)
        np.testing.assert_allclose(figure.com[scene], data.subtree_com[1], atol=1e-6)
        expected = about_the_world(jacobian, figure, scene)
        np.testing.assert_allclose(figure.com_jacobian[scene], expected, atol=1e-6)
        np.testing.assert_allclose(figure.com_velocity[scene], jacobian @ data.qvel, atol=1e-5)
    assert pytest.approx(mujoco.mj_getTotalmass(model)) == BODY_KG


def test_weight_and_its_bearing_are_mujocos_gravity() -> None:
    """At rest, what the joints exert against gravity is MuJoCo's bias force."""
    qpos, qvel = random_states(2)
    figure = Figure.of(qpos, torch.zeros_like(qvel))
    up = torch.tensor([[0.0, 0.0, BODY_KG * GRAVITY_M_S2]], dtype=torch.float64).expand(2, 3)
    effort = moments(figure.com_jacobian, up)
    for scene in range(2):
        _, data = in_mujoco(qpos[scene], torch.zeros_like(qvel[scene]))
        np.testing.assert_allclose(effort[scene, 6:], data.qfrc_bias[6:], atol=1e-4)


def test_a_load_moves_the_centre_of_mass() -> None:
    figure = Figure.of(torch.from_numpy(character.standing_qpos())[None], torch.zeros(1, 34))
    ahead = figure.com + torch.tensor([[0.5, 0.0, 0.0]])
    mass = Mass.of(figure, Load(torch.tensor([BODY_KG / 4.0]), ahead))
    assert mass.mass_kg.item() == pytest.approx(1.25 * BODY_KG)
    # a fifth of it is 0.5 m ahead
    moved = mass.position - figure.com[:, :2]
    torch.testing.assert_close(moved, torch.tensor([[0.1, 0.0]], dtype=torch.float64))


def test_the_heavier_of_two_tasks_that_contradict_wins_by_its_weight_squared() -> None:
    tasks = Tasks()
    row = torch.zeros(1, 1, 34, dtype=torch.float64)
    row[0, 0, 7] = 1.0
    tasks.add(row, torch.tensor([[0.3]]).double(), 2.0)
    tasks.add(row, torch.tensor([[-0.1]]).double(), torch.tensor([1.0]))
    move = tasks.solve()
    # (4 · 0.3 − 1 · 0.1) / (4 + 1 + damping²)
    assert move[0, 7].item() == pytest.approx(1.1 / (5.0 + 0.15**2))
    assert move.abs().sum() == move[0, 7]


def test_set_points_are_a_share_of_the_move_and_the_effort_by_the_stiffness() -> None:
    figure = Figure.of(torch.from_numpy(character.standing_qpos())[None], torch.zeros(1, 34))
    move, effort = torch.zeros(2, 1, 34, dtype=torch.float64)
    move[0, 6 + 17], effort[0, 6 + 17] = 0.1, 25.0
    found = set_points(figure, move, effort, torch.tensor([0.5]).double())
    # a knee of 500 N·m/rad, bent by 0.2
    assert found[0, 17].item() == pytest.approx(0.2 + 0.05 + 25.0 / 500.0)
    _, high = character.set_point_bounds()
    far = set_points(figure, 100.0 * move, 1e6 * effort, torch.tensor([0.5]).double())
    assert far[0, 17].item() == pytest.approx(high[17])


def test_attitudes_face_and_bend_forward() -> None:
    heading = unit(torch.tensor([0.7], dtype=torch.float64))
    bent = attitude(heading, torch.tensor([0.4], dtype=torch.float64))
    q = rotations.multiply(
        torch.tensor([[np.cos(0.35), 0.0, 0.0, np.sin(0.35)]]),
        torch.tensor([[np.cos(0.2), 0.0, np.sin(0.2), 0.0]]),
    )
    torch.testing.assert_close(bent, rotations.matrix(q))
    level = attitude(heading, torch.zeros(1, dtype=torch.float64))
    turn = rotation_error(level, bent)
    left = torch.tensor([[-np.sin(0.7), np.cos(0.7), 0.0]])
    torch.testing.assert_close(turn, 0.4 * left)


def squat(height_m: list[float], steps: int) -> tuple[Tensor, Tensor, Tensor]:
    """Both hands move to this height before the feet: the largest distance of the mass from its
    target [n], the final distance of the hands from theirs [n], m, and qpos [n, 43]."""
    n = len(height_m)
    scenes = Scenes([compile_scene(None)] * n, 0.35, 3.0)
    standing = torch.from_numpy(character.standing_qpos()).float()[None].repeat(n, 1)
    none, ahead = torch.zeros(n, 3), torch.tensor([[1.0, 0.0]]).repeat(n, 1)
    scenes.set_state(torch.arange(n), standing, torch.zeros(n, 34), none - 5.0, ahead)
    gait, worst = Gait(n), torch.zeros(n, dtype=torch.float64)
    high = torch.tensor(height_m, dtype=torch.float64)
    goal = torch.stack([torch.tensor([0.40, y]).double().expand(n, 2) for y in (-0.2, 0.2)], dim=1)
    goal = torch.cat((goal, high[:, None, None].expand(n, 2, 1)), dim=2)
    left = torch.tensor([[0.0, 1.0, 0.0]]).double().expand(n, 3)
    for _ in range(steps):
        figure = Figure.of(scenes.qpos, scenes.qvel)
        feet, mass = Footing.of(figure), Mass.of(figure, Load(torch.zeros(n), none.double()))
        way = goal - figure.position[:, HANDS]
        step = way * (0.05 / way.norm(dim=2, keepdim=True).clamp_min(0.05))
        active, held = torch.ones(n, dtype=torch.bool), torch.zeros(n, dtype=torch.bool)
        reach = Reach(active, held, step, torch.zeros_like(step), goal, high, left, goal)
        stops = torch.ones(n, dtype=torch.bool)
        stride = gait.advance(feet, mass, torch.zeros(n, 3).double(), stops)
        pace = Pace(torch.full((n,), 0.8).double(), torch.zeros(n, 2), torch.zeros(n, 3))
        scenes.drive(mover.move(figure, feet, mass, stride, reach, pace))
        worst = torch.maximum(worst, (mass.position - mover.resting(feet)).norm(dim=1))
    figure = Figure.of(scenes.qpos, scenes.qvel)
    return worst, (figure.position[:, HANDS] - goal).norm(dim=2).amax(dim=1), scenes.qpos


def test_a_squat_reaches_low_and_keeps_its_balance() -> None:
    worst, missed, qpos = squat([1.1, 0.8, 0.6, 0.45], 150)
    assert worst.max() < 0.02
    assert missed.max() < 0.05
    assert (qpos[1:, 2] < qpos[:-1, 2]).all(), "the lower the hands, the lower the pelvis"

"""Disturbances of training by physics: impulses, balls in flight, objects that move as asked."""

import math
from dataclasses import replace
from functools import cache

import mujoco
import numpy as np
import pytest
import torch

from world import random_streams, tasks
from world.character import model as character
from world.config import InitialStates, PerturbConfig, WorldConfig
from world.episodes import disturbances
from world.episodes.shard import Shard
from world.errors import ConfigError
from world.motions import load
from world.motions.library import MotionLibrary
from world.objects.bank import ObjectBank
from world.scene.perturbations import TRAINING, Moving, launch

ALL = PerturbConfig(pushes_per_s=2.0, projectiles_per_s=2.0, moved_fraction=0.7)
TASKS = ("sit", "lie", "carry", "walk")


def world(task: str, perturb: PerturbConfig, **initial: object) -> WorldConfig:
    made = WorldConfig(task=task, pieces=4, scales=1, perturb=perturb)
    made = replace(made, carry=replace(made.carry, sizes=4))
    return replace(made, initial=replace(InitialStates(standing_fraction=0.5), **initial))


@cache
def clips(task: str) -> MotionLibrary:
    """A few of the package's own clips."""
    use = tasks.make(task).affordance.clips
    found = load.clips(use=use)
    return MotionLibrary(found[:: max(1, len(found) // 8)], False, use)


@cache
def bank(config: WorldConfig) -> ObjectBank:
    return tasks.make(config.task).affordance.bank(config)


def shard(config: WorldConfig, scenes: range = range(64), seed: int = 5) -> Shard:
    return Shard(config, clips(config.task), bank(config), scenes, seed)


def roll(one: Shard, scenes: range, steps: int) -> list[torch.Tensor]:
    found = []
    for _ in range(steps):
        ids = torch.arange(scenes.start, scenes.stop)
        step = one.step(0.2 * random_streams.normal(7, ids, one.clock, character.NU))
        state, goal = one.observe()
        found.append(torch.cat((state, goal, step.reward[:, None], step.fell[:, None]), dim=1))
    return found


@pytest.mark.parametrize("task", TASKS)
def test_scenes_are_the_same_however_they_are_divided_and_after_a_restart(task: str) -> None:
    config = world(task, ALL)
    whole = shard(config)
    expected = roll(whole, range(64), 24)
    saved = {name: value.clone() for name, value in whole.state_dict().items()}
    assert float(saved["disturbance_ball_age_s"].min()) < 1.0, "balls are in flight"
    assert bool((saved["disturbance_move_elapsed_s"] > 0.0).any()), "objects move"
    further = roll(whole, range(64), 20)
    part = shard(config, range(16, 48))
    for here, there in zip(roll(part, range(16, 48), 24), expected, strict=True):
        assert torch.equal(here, there[16:48])
    other = shard(config)
    roll(other, range(64), 3)
    other.load_state_dict(saved)
    for here, there in zip(roll(other, range(64), 20), further, strict=True):
        assert torch.equal(here, there)


def momentum(one: Shard, scene: int) -> np.ndarray:
    """Of the character, by masses and velocities of its bodies, kg m/s."""
    model = one._scenes.models[scene]
    data = mujoco.MjData(model)
    state = one._scenes.physics()
    data.qpos[:], data.qvel[:] = state["qpos"][scene], state["qvel"][scene]
    mujoco.mj_forward(model, data)
    total = np.zeros(3)
    for name in character.BODIES:
        body, velocity = model.body(name).id, np.zeros(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, body, velocity, 0)
        total += model.body_mass[body] * velocity[3:]  # of the centre of mass
    return total


def test_a_push_gives_its_impulse_as_mass_times_velocity() -> None:
    """Characters in free fall against the same ones without a push."""
    pushed = shard(world("walk", PerturbConfig(pushes_per_s=30.0, push_n_s=(8.0, 20.0))))
    calm = shard(world("walk", PerturbConfig()))
    given: list[tuple[torch.Tensor, torch.Tensor, torch.Tensor]] = []
    push = pushed._scenes.push
    pushed._scenes.push = lambda *what: (given.append(what), push(*what))[1]  # type: ignore
    for one in (pushed, calm):
        one._scenes.qpos[:, 2] += 5.0
        one._steps[:] = 0  # no episode ends by its time limit
        assert not len(one.step(torch.zeros(64, character.NU)).end_ids)
    ((ids, bodies, impulse),) = given
    assert ids.tolist() == list(range(64)), "30 a second is one in each control step"
    assert set(bodies.tolist()) == {0, 1}, "pelvis and torso"
    strength = impulse.norm(dim=1)
    assert 8.0 <= float(strength.min()) < 9.5 and 18.5 < float(strength.max()) <= 20.0
    assert float(impulse[:, 2].abs().max()) == 0.0
    gained = [momentum(pushed, scene) - momentum(calm, scene) for scene in range(64)]
    off = np.abs(np.array(gained) - impulse.numpy()).max(axis=1) / strength.numpy()
    # the discrete steps of a jointed body in motion do not keep momentum exactly
    assert np.median(off) < 0.005 and off.max() < 0.05
    # nothing of the force is left for the next step
    pushed._scenes.push = lambda *what: None  # type: ignore
    for one in (pushed, calm):
        one.step(torch.zeros(64, character.NU))
    later = [momentum(pushed, scene) - momentum(calm, scene) for scene in range(64)]
    off = np.abs(np.array(later) - np.array(gained)).max(axis=1) / strength.numpy()
    assert np.median(off) < 0.02


def test_pushes_and_balls_come_at_their_rates_in_the_given_fraction_of_the_episodes() -> None:
    how = PerturbConfig(fraction=0.25, pushes_per_s=3.0, projectiles_per_s=1.5)
    one, balls = shard(world("walk", how), range(128)), 0
    push = one._scenes.push
    pushed: list[int] = []
    one._scenes.push = lambda ids, *what: (pushed.append(len(ids)), push(ids, *what))[1]  # type: ignore
    for _ in range(60):
        one.step(torch.zeros(128, character.NU))
        ages = one.state_dict()["disturbance_ball_age_s"]
        balls += int((ages == 0.0).sum())
    seconds = 0.25 * 128 * 60 / character.CONTROL_HZ
    for count, rate in ((sum(pushed), 3.0), (balls, 1.5)):
        expected = rate * seconds
        # the fraction itself varies: 128 scenes and their resets, about 10 %
        assert abs(count - expected) < 4.0 * math.sqrt(expected) + 0.25 * expected


def test_a_ball_flies_at_the_character_with_its_mass_and_speed_and_leaves() -> None:
    one = shard(world("walk", PerturbConfig(projectiles_per_s=30.0)), range(32))
    clock = one.clock + 1
    one.step(torch.zeros(32, character.NU))
    model, state = one._scenes.models[0], one._scenes.physics()
    ball = model.body("projectile0")
    assert model.body_mass[ball.id] == pytest.approx(1.2)
    body = one._scenes.body()
    u = random_streams.uniform(5, random_streams.DISTURBED_STEP, torch.arange(32), clock, 9)
    position, velocity = launch(TRAINING, u[:, 5:], body, torch.arange(32))
    first, speed = int(model.jnt_qposadr[ball.jntadr[0]]), int(model.jnt_dofadr[ball.jntadr[0]])
    # characters whose episode ended in this step have theirs parked
    flying = one.state_dict()["disturbance_ball_age_s"][:, 0] == 0.0
    assert int(flying.sum()) > 16
    torch.testing.assert_close(state["qpos"][flying, first : first + 3].float(), position[flying])
    found = state["qvel"][flying, speed : speed + 3].float()
    torch.testing.assert_close(found, velocity[flying])
    # 10 m/s along the line to the aim, relative to the root, beside the drop's compensation
    along = found - body.root_velocity[flying]
    assert float((along.norm(dim=1) - 10.0).abs().max()) < 1.5
    one._reset(torch.arange(32))
    assert bool(torch.isinf(one.state_dict()["disturbance_ball_age_s"]).all())
    assert float(one._scenes.physics()["qpos"][:, first + 2].min()) == 40.0


@pytest.mark.parametrize("task", TASKS)
def test_a_piece_moves_as_drawn_and_the_goal_follows(task: str) -> None:
    """Against the mocap body of the simulator, which is where the piece really is."""
    only = {"reference": 0.0, "near": 1.0, "far": 0.0, "front_fraction": 0.0}
    config = world(task, PerturbConfig(moved_fraction=1.0), near_m=(1.0, 1.6), **only)
    one = shard(config)
    mover, pieces = one._disturbances._mover, one._bank  # type: ignore[union-attr]
    began = one.state_dict()
    point, facing = began["disturbance_move_point"], began["disturbance_move_facing"]
    moved = torch.zeros(64, dtype=torch.bool)
    for _ in range(20):
        step = one.step(torch.zeros(64, character.NU))
        moved[mover.elapsed_s >= Moving().seconds] = True
        moved[step.end_ids] = False
    here = torch.nonzero(moved & (one._episode == 1)).flatten()
    assert len(here) > 10
    state = one._scenes.physics()
    at, quat = state["mocap_pos"][here, 0].float(), state["mocap_quat"][here, 0].float()
    yaw = 2.0 * torch.atan2(quat[:, 3], quat[:, 0])
    turned = torch.stack((yaw.cos(), yaw.sin()), dim=1)

    def turn(by: torch.Tensor, what: torch.Tensor) -> torch.Tensor:
        c, s = by.unbind(1)
        return torch.stack((c * what[:, 0] - s * what[:, 1], s * what[:, 0] + c * what[:, 1]), 1)

    if task in ("sit", "lie"):
        variant = one._variant[here]
        use = at[:, :2] + turn(turned, pieces.point[variant, :2])
        facing_now = turn(turned, pieces.facing[variant])
    else:
        use, facing_now = at[:, :2], turned
    shift = use - point[here]
    torch.testing.assert_close(shift.norm(dim=1), mover._shift_m[here], atol=1e-4, rtol=0)
    before = facing[here]
    angle = torch.atan2(
        before[:, 0] * facing_now[:, 1] - before[:, 1] * facing_now[:, 0],
        (before * facing_now).sum(dim=1),
    )
    torch.testing.assert_close(angle, mover._turn[here], atol=1e-4, rtol=0)
    target = one._target()
    if task == "carry":
        box = target.box
        assert box is not None
        torch.testing.assert_close(box.start[here, :2], use, atol=1e-5, rtol=0)
        # a box that rests on the stand went with it, but for what it slid since
        assert float((box.position[here, :2] - use).norm(dim=1).median()) < 0.02
    else:
        torch.testing.assert_close(target.point[here, :2], use, atol=1e-4, rtol=0)
        torch.testing.assert_close(target.facing[here], facing_now, atol=1e-4, rtol=0)
    body = one._scenes.body()
    goal = one.task.goal_features(body, target)
    torch.testing.assert_close(one.observe()[1][here], goal[here])
    torch.testing.assert_close(one.observe()[0][here], tasks.state(body, target)[here])


def test_objects_stay_where_the_character_begins_at_them() -> None:
    only = InitialStates(reference=1.0, near=0.0, far=0.0, reference_stages=(0.0, 0.0, 1.0))
    config = replace(world("sit", PerturbConfig(moved_fraction=1.0)), initial=only)
    one = shard(config)
    for _ in range(5):
        one.step(torch.zeros(64, character.NU))
    assert float(one.state_dict()["disturbance_move_elapsed_s"].max()) == -1.0


def test_without_rates_nothing_of_it_is_there() -> None:
    one, other = (shard(world("sit", how)) for how in (PerturbConfig(), ALL))
    assert not [name for name in one.state_dict() if name.startswith("disturbance")]
    assert one._scenes.models[0].nq == character.NQ
    assert other._scenes.models[0].nq == character.NQ + 7 * TRAINING.flying
    assert not disturbances.active(PerturbConfig(fraction=0.0, pushes_per_s=1.0))


@pytest.mark.parametrize(
    ("config", "simulator", "said"),
    [
        (WorldConfig(perturb=ALL), "warp", "--world.perturb.pushes-per-s needs --simulator mujoco"),
        (WorldConfig(task="track", perturb=ALL), "mujoco", "moved-fraction"),
        (
            WorldConfig(perturb=PerturbConfig(pushes_per_s=1.0, push_n_s=(9.0, 3.0))),
            "mujoco",
            "push-n-s 9 3",
        ),
    ],
)
def test_what_cannot_be_is_refused(config: WorldConfig, simulator: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        disturbances.check(config, simulator)
    disturbances.check(replace(config, perturb=PerturbConfig()), simulator)

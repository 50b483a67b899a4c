"""Disturbances by physics and geometry: balls hit, hand over momentum, leave; furniture moves."""

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest
import torch

from world.character import features
from world.character import model as character
from world.config import WorldConfig
from world.furniture.catalogue import catalogue
from world.objects.furniture_bank import FurnitureBank
from world.scene.batch import Scenes
from world.scene.perturbations import Mover, Thrower, Throwing, draw, launch

STAND = torch.from_numpy(character.standing_qpos())


def body_at(*roots: tuple[float, float], velocity: tuple[float, float] = (0.0, 0.0)):
    qpos = STAND.float().repeat(len(roots), 1)
    qpos[:, :2] = torch.tensor(roots)
    qvel = torch.zeros(len(roots), character.NV)
    qvel[:, :2] = torch.tensor(velocity)
    return features.body(qpos, qvel)


def test_throws_are_at_different_random_steps_within_the_limit() -> None:
    what = draw("projectiles", 500, 7, 600)
    assert what.step.shape == (500, 20)
    assert what.step.min() >= 0 and what.step.max() < 600
    assert (what.step.diff(dim=1) > 0).all()
    # uniform over the trial: each tenth of it gets a tenth of the throws, within 4 deviations
    counts = np.histogram(what.step.flatten(), 10, (0, 600))[0]
    assert np.abs(counts - 1000).max() < 4 * math.sqrt(900)


def test_a_launched_ball_meets_the_walking_body() -> None:
    body = body_at((2.0, -1.0), velocity=(0.8, 0.3))
    u = torch.rand(200, 4, generator=torch.Generator().manual_seed(0))
    position, velocity = launch(Throwing(), u, body, torch.zeros(200, dtype=torch.int64))
    start = position - body.root
    reach = start[:, :2].norm(dim=1)
    assert reach.min() >= 2.0 and reach.max() <= 3.0
    assert position[:, 2].min() >= 0.25 and position[:, 2].max() <= 2.0
    # free flight against where the aimed-at body will be, at the moment of meeting
    which = (u[:, 3] * 15).long()
    aim = body.position[0, which]
    seconds = (aim - position).norm(dim=1, keepdim=True) / 10.0
    gravity = torch.tensor([0.0, 0.0, -9.81])
    landed = position + velocity * seconds + 0.5 * gravity * seconds**2
    torch.testing.assert_close(landed, aim + body.root_velocity * seconds, atol=1e-4, rtol=0)


@pytest.fixture(scope="module")
def scenes() -> Scenes:
    """Three scenes with balls, furniture far away, characters standing at the origin."""
    what = draw("projectiles", 3, 0, 60)
    bank = FurnitureBank(catalogue("test")[:3], "sit", what.balls())
    config = WorldConfig()
    made = Scenes(bank.models, config.action_scale, config.action_clip)
    every = torch.arange(3)
    far = torch.full((3, 2), 20.0)
    ahead = torch.tensor([[1.0, 0.0]]).repeat(3, 1)
    made.set_state(every, STAND.repeat(3, 1), torch.zeros(3, 34), *bank.placed(every, far, ahead))
    return made


def test_balls_hit_push_and_leave(scenes: Scenes) -> None:
    what = draw("projectiles", 3, 0, 600)
    # scene 0: one ball from the front at the torso; 1: five balls, more than fly; 2: none
    step = torch.full((3, 20), 10_000)
    step[0, 0] = 5
    step[1, :5] = torch.arange(5) * 2 + 5
    chosen = what.draw.clone()
    chosen[..., 0] = 0.0
    chosen[..., 1], chosen[..., 2] = 0.0, 0.5
    chosen[..., 3] = 1.5 / 15
    thrower = Thrower(replace(what, step=step, draw=chosen), scenes)
    assert torch.isnan(thrower.position).all()
    seen, speed = [], []
    neutral = torch.zeros(3, character.NU)
    for at in range(90):
        thrower.step(at, scenes.body(), 1 / 30)
        seen.append((~torch.isnan(thrower.position[..., 0])).sum(1))
        scenes.act(neutral)
        speed.append(scenes.qvel[:, 0].clone())
    count = torch.stack(seen)
    assert count[:5].sum() == 0 and count[:, 2].sum() == 0
    assert count[5, 0] == 1 and count[:, 0].max() == 1
    assert count[:, 1].max() == 4  # the fifth took the place of the first
    assert count[5 + 59, 0] == 1 and count[5 + 62, 0] == 0  # two seconds later it is gone
    pushed = torch.stack(speed)[:20]
    # from +x at 10 m/s, 1.2 kg on 49 kg: the root is pushed back, more by five than by one
    assert (pushed[:12, 0] - pushed[:12, 2]).min() < -0.1
    assert (pushed[:, 1] - pushed[:, 2]).min() < (pushed[:, 0] - pushed[:, 2]).min() - 0.1


def test_a_hit_hands_over_its_momentum() -> None:
    """A floating, servoed character hit in the trunk: between inelastic and slightly elastic."""
    model = FurnitureBank(
        catalogue("test")[:1], "sit", draw("projectiles", 1, 0, 60).balls()
    ).models[0]
    model.opt.gravity[:] = 0
    data = mujoco.MjData(model)
    data.qpos[: character.NQ] = STAND
    data.qpos[2] += 5.0
    data.mocap_pos[0] = [50, 0, 0]
    ball = character.NQ
    data.qpos[ball : ball + 3] = [1.0, 0.0, data.qpos[2] + 0.35]
    data.qvel[character.NV] = -10.0
    for _ in range(60):
        mujoco.mj_step(model, data)
    mujoco.mj_subtreeVel(model, data)
    handed = -data.subtree_linvel[1][0] * model.body_subtreemass[1] / (1.2 * 10.0)
    left = data.qvel[character.NV]
    assert 1.0 <= handed < 1.25
    assert handed == pytest.approx((10.0 + left) / 10.0, abs=0.02)  # nothing is lost


def test_furniture_moves_away_once_when_the_character_is_near() -> None:
    what = draw("moved", 400, 1, 600)
    point = torch.tensor([[3.0, 1.0]]).repeat(400, 1)
    ahead = torch.tensor([[1.0, 0.0]]).repeat(400, 1)
    mover = Mover(what, point, ahead)
    assert mover.step(body_at(*[(0.0, 1.0)] * 400), 1 / 30) is None  # 3 m off
    body = body_at(*[(1.8, 1.0)] * 400)  # 1.2 m off: half of the thresholds, 0.4-2 m
    paths = [mover.step(body, 1 / 30) for _ in range(30)]
    share = (mover.elapsed_s >= 0).double().mean()
    assert share == pytest.approx(0.5, abs=0.08)
    assert paths[0] is not None and paths[14] is not None
    assert all(path is None for path in paths[15:])  # half a second, then never again
    ids, end, facing = paths[14]
    assert torch.equal(ids, torch.nonzero(mover.elapsed_s >= 0).flatten())
    shift = end - point[ids]
    length = shift.norm(dim=1)
    assert length.min() >= 0.5 and length.max() <= 1.5 and length.max() > 1.3
    assert (shift[:, 0] >= -1e-4).all()  # away from the character, who is at −x of it
    turned = torch.atan2(facing[:, 1], facing[:, 0]).abs()
    assert turned.max() <= math.pi / 4 + 1e-5 and turned.max() > 0.6
    halfway = (paths[6][1] - point[ids]).norm(dim=1) / length
    # 7 of 15 steps: s²(3 − 2s)
    assert halfway.mean().item() == pytest.approx((7 / 15) ** 2 * (3 - 14 / 15), abs=1e-3)

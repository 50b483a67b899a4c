"""Foot skating, jerk and raised hands cost what they measure, and nothing across the beginning of
an episode."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from world.character import features
from world.character import model as character
from world.config import InitialStates, PenaltyConfig, WorldConfig
from world.episodes.penalties import HZ, JERK_M_S3, Penalties
from world.episodes.shard import Shard
from world.motions.library import MotionLibrary
from world.motions.synthetic.library import walking
from world.motions.uses.floor import FLOOR
from world.objects.floor_bank import FloorBank
from world.realism import measures
from world.tasks import reward

#: Of walk's terms and the two penalties.
WEIGHTS = [0.35, 0.25, 0.2, 0.2, 0.4, 0.25, 0.25]


def standing(x_m: list[float]) -> list[features.Body]:
    """One body that stands on the floor, at each of these places in turn."""
    qpos = torch.from_numpy(character.standing_qpos()).float().repeat(len(x_m), 1)
    lowest = measures.sole_corners(qpos)[..., 2].amin()
    qpos[:, 0], qpos[:, 2] = torch.tensor(x_m), qpos[:, 2] - lowest.float()
    return [features.body(row[None], torch.zeros(1, character.NV)) for row in qpos]


def costs(config: PenaltyConfig, bodies: list[features.Body]) -> list[float]:
    """What each body but the first costs, with the weight of the one penalty that has any."""
    penalties = Penalties(1, config)
    penalties.reset(torch.tensor([0]), bodies[0])
    (weight,) = reward.penalties(config).values()
    return [-weight * float(penalties.after(body)) for body in bodies[1:]]


def test_skating_costs_its_speed() -> None:
    """0.4 m/s costs two fifths of the weight, 3 m/s all of it, and standing nothing."""
    slides = standing([0.0, 0.4 / HZ, 0.4 / HZ, 0.4 / HZ + 0.1])
    found = costs(PenaltyConfig(skating=0.5), slides)
    assert found == pytest.approx([0.2, 0.0, 0.5], abs=1e-4)


def test_jerk_costs_the_third_difference() -> None:
    """Bodies at t², and 5 mm further in the last frame: the first have no jerk, the last
    0.005 · 30³ m/s³."""
    x = [0.001 * k**2 for k in range(6)]
    x[-1] += 0.005
    found = costs(PenaltyConfig(jerk=1.0), standing(x))
    assert found[:4] == pytest.approx([0.0] * 4, abs=2e-2)
    assert found[4] == pytest.approx(0.005 * HZ**3 / JERK_M_S3, rel=0.05)


def test_hands_cost_how_high_they_are_held_at_rest() -> None:
    """Hands that hang, or rest on the belly, cost nothing; from 0.2 m above the pelvis their height
    does, up to the whole weight; and no height does while the character moves."""
    (body,) = standing([0.0])
    assert costs(PenaltyConfig(hands=1.0), [body, body]) == [0.0]
    hands = [character.BODIES.index(f"{side}_hand") for side in ("right", "left")]

    def raised(right_m: float, left_m: float, speed_m_s: float = 0.0) -> features.Body:
        position = body.position.clone()
        position[0, hands, 2] = position[0, 0, 2] + torch.tensor([right_m, left_m])
        velocity = torch.tensor([[speed_m_s, 0.0, 0.0]])
        return replace(body, position=position, root_velocity=velocity)

    found = costs(
        PenaltyConfig(hands=0.6),
        [body, raised(0.16, 0.2), raised(0.35, 0.1), raised(0.35, 0.35), raised(1.0, 0.9),
         raised(1.0, 0.9, 0.2)],
    )  # fmt: skip
    assert found == pytest.approx([0.0, 0.15, 0.3, 0.6, 0.0], abs=1e-5)


def test_they_are_the_measures_of_realism() -> None:
    clip = walking(np.random.default_rng(0), 1.0)
    qpos = torch.from_numpy(clip.qpos()[:60]).float()
    bodies = [features.body(row[None], torch.zeros(1, character.NV)) for row in qpos]
    jerk = costs(PenaltyConfig(jerk=0.5), bodies)[2:]
    expected = measures.jerk(measures.positions(qpos), HZ).mean(dim=1).numpy() / JERK_M_S3
    assert expected.max() < 1.0
    assert jerk == pytest.approx(0.5 * expected, rel=0.05, abs=2e-3)
    skating = costs(PenaltyConfig(skating=0.5), bodies)
    for k, cost in enumerate(skating):
        total, planted = measures.skating(qpos[k : k + 2], HZ)
        assert cost == pytest.approx(0.5 * min(total / max(planted, 1), 1.0), abs=1e-3)


def test_a_shard_takes_them_off_the_reward_and_forgets_at_a_reset() -> None:
    """Far starts that fall at once, so that episodes end within the steps: no cost from one
    episode to the next, where the character jumps by metres."""
    plain = WorldConfig(task="walk", initial=InitialStates(0, 0, 1))
    dear = replace(plain, penalty=PenaltyConfig(skating=0.25, jerk=0.25))
    library = MotionLibrary([walking(np.random.default_rng(0), 1.0)], use=FLOOR)
    shards = [Shard(config, library, FloorBank(), range(32), 1) for config in (plain, dear)]
    actions = torch.zeros(32, 28)
    began, cost, ended = torch.zeros(32, dtype=torch.bool), [], 0
    for _ in range(60):
        one, other = (shard.step(actions) for shard in shards)
        cost.append(one.reward - other.reward)
        assert (cost[-1][began] <= 0.25 + 1e-6).all(), "the first step has no jerk yet"
        began = one.fell | one.timed_out
        ended += int(began.sum())
    assert torch.stack(cost).min() >= -1e-6
    assert 0.01 < torch.stack(cost).mean() < 0.5
    torch.testing.assert_close(other.reward, other.terms @ torch.tensor(WEIGHTS))
    assert ended > 20

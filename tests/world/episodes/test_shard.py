"""The shard: its numbers depend on seed, scene and episode alone."""

from dataclasses import replace

import pytest
import torch

from world import random_streams
from world.config import PenaltyConfig, WorldConfig
from world.episodes.shard import Shard
from world.furniture.catalogue import catalogue
from world.motions import load
from world.motions.library import MotionLibrary
from world.objects.furniture_bank import FurnitureBank, variants

CONFIG = WorldConfig(pieces=8, scales=2, penalty=PenaltyConfig(skating=0.3, jerk=0.3))


@pytest.fixture(scope="module")
def library() -> MotionLibrary:
    return MotionLibrary(load.own_clips())


@pytest.fixture(scope="module")
def bank() -> FurnitureBank:
    return FurnitureBank(variants(catalogue("train", CONFIG.pieces), CONFIG.scales, CONFIG.scale))


def actions(scenes: range, clock: int) -> torch.Tensor:
    return 0.3 * random_streams.normal(7, torch.arange(scenes.start, scenes.stop), clock, 28)


def roll(shard: Shard, scenes: range, steps: int) -> dict[str, torch.Tensor]:
    out: dict[str, list[torch.Tensor]] = {"state": [], "goal": [], "reward": [], "fell": []}
    for _ in range(steps):
        step = shard.step(actions(scenes, shard.clock))
        state, goal = shard.observe()
        out["state"].append(state.clone())
        out["goal"].append(goal.clone())
        out["reward"].append(step.reward)
        out["fell"].append(step.fell)
    return {name: torch.stack(rows) for name, rows in out.items()}


def test_sharding_changes_no_bit(library: MotionLibrary, bank: FurnitureBank) -> None:
    whole = roll(Shard(CONFIG, library, bank, range(96), 5), range(96), 50)
    assert whole["fell"].any()  # episodes ended, so resets are compared too
    for scenes in (range(32), range(32, 96)):
        part = roll(Shard(CONFIG, library, bank, scenes, 5), scenes, 50)
        for name, rows in part.items():
            assert torch.equal(rows, whole[name][:, scenes.start : scenes.stop]), name


def test_exact_continuation(library: MotionLibrary, bank: FurnitureBank) -> None:
    scenes = range(32)
    first = Shard(CONFIG, library, bank, scenes, 5)
    roll(first, scenes, 30)
    saved = {k: v.clone() for k, v in first.state_dict().items()}
    expected = roll(first, scenes, 40)
    second = Shard(CONFIG, library, bank, scenes, 5)
    roll(second, scenes, 3)
    second.load_state_dict(saved)
    found = roll(second, scenes, 40)
    for name in expected:
        assert torch.equal(found[name], expected[name]), name


def test_observations_are_finite_and_episodes_count(
    library: MotionLibrary, bank: FurnitureBank
) -> None:
    shard = Shard(replace(CONFIG, penalty=PenaltyConfig()), library, bank, range(64), 1)
    ended = 0
    for _ in range(60):
        step = shard.step(actions(range(64), shard.clock))
        state, goal = shard.observe()
        assert state.isfinite().all()
        assert goal.isfinite().all()
        assert step.finite.all()
        assert torch.equal(step.end_ids, torch.nonzero(step.fell | step.timed_out).flatten())
        assert len(step.end_states) == len(step.end_ids) == len(step.episodes["length"])
        # the clocks begin anywhere, but nothing is longer than what was simulated
        assert (step.episodes["length"] <= shard.clock).all()
        ended += len(step.end_ids)
        torch.testing.assert_close(
            step.reward, step.terms @ torch.tensor(list(shard.task.terms.values()))
        )
    assert ended > 20


def test_a_blown_up_scene_is_reset_and_its_sample_void(
    library: MotionLibrary, bank: FurnitureBank
) -> None:
    shard = Shard(CONFIG, library, bank, range(32), 2)
    shard._scenes.qvel[7, 10] = 1e6
    step = shard.step(torch.zeros(32, 28))
    assert not step.finite[7]
    assert step.finite.sum() == 31
    assert step.reward[7] == 0
    assert step.broken.shape == (1, 77)
    assert step.broken[0, 43 + 10] == 1e6
    assert 7 not in step.end_ids.tolist()
    state, _ = shard.observe()
    assert state.isfinite().all()
    again = shard.step(torch.zeros(32, 28))
    assert again.finite.all()

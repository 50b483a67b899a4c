"""Counts of the scenes, by hand on scripted steps and against the rollout of the same scenes."""

import pickle
from dataclasses import dataclass
from pathlib import Path

import pytest
import torch

from actors.worker import Worker
from console.bench.peers.counters import CountedShard, CountError, Counts, counted, read
from policy.model.acting import publish
from policy.model.networks import Actor
from policy.model.normaliser import Normaliser
from tests.support.faulty_shard import MakePoints
from tests.support.point_shard import ACTION, GOAL, STATE, PointShard


@dataclass
class ScriptedStep:
    reward: torch.Tensor
    fell: torch.Tensor
    timed_out: torch.Tensor
    finite: torch.Tensor


class Scripted:
    """Two scenes that do as they are told, by steps: rewards, falls, time-outs, finite."""

    def __init__(self, steps: list[tuple[list[float], list[int], list[int], list[int]]]) -> None:
        self.steps = iter(steps)

    def observe(self) -> tuple[torch.Tensor, torch.Tensor]:
        return torch.zeros(2, 1), torch.zeros(2, 1)

    def step(self, action: torch.Tensor) -> ScriptedStep:
        reward, *flags = next(self.steps)
        return ScriptedStep(torch.tensor(reward), *(torch.tensor(flag).bool() for flag in flags))


def test_counts_by_hand(tmp_path: Path) -> None:
    nan = float("nan")
    steps = [
        ([1.0, 0.5], [0, 0], [0, 0], [1, 1]),
        ([2.0, 0.25], [1, 0], [0, 0], [1, 1]),  # the first falls, with a return of 3
        ([4.0, 0.25], [0, 0], [0, 1], [1, 1]),  # the second is truncated, with a return of 1
        ([nan, 8.0], [0, 0], [0, 0], [0, 1]),  # the first is non-finite, with its 4 of before
    ]
    shard = CountedShard(Scripted(steps), tmp_path / "0.npy")
    assert read(tmp_path) == Counts()
    found = []
    for _ in steps:
        shard.step(torch.zeros(2, 1))
        found.append(read(tmp_path))
    assert found == [
        Counts(2, 1.5, 0, 0.0, 0),
        Counts(4, 3.75, 1, 3.0, 1),
        Counts(6, 8.0, 2, 4.0, 1),
        Counts(8, 16.0, 3, 8.0, 2),
    ]
    assert found[3] - found[1] == Counts(4, 12.25, 2, 5.0, 1)


def test_counts_of_all_shards_are_those_of_the_rollout(tmp_path: Path) -> None:
    """Also in a factory that was pickled, as for a process."""
    make = pickle.loads(pickle.dumps(counted(MakePoints(5), str(tmp_path))))
    torch.manual_seed(0)
    weights = publish(Actor(STATE + GOAL, ACTION, (8,)), Normaliser(STATE + GOAL))
    rollouts = [
        Worker(make(scenes), scenes, 3, 4).rollout(weights, 0, 60, 1.5)
        for scenes in (range(4), range(4, 8))
    ]
    found = read(tmp_path)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["0.npy", "4.npy"]
    assert found.control_steps == 60 * 8
    assert found.reward == pytest.approx(sum(float(r.rewards.sum()) for r in rollouts))
    assert found.episodes == sum(len(r.end_index) for r in rollouts) > 0
    assert found.falls == sum(int(r.fell.sum()) for r in rollouts) > 0
    whole = sum(float(r.episodes["return"].sum()) for r in rollouts)
    assert found.returns == pytest.approx(whole)


def test_the_rest_of_a_shard_is_its_own(tmp_path: Path) -> None:
    shard, alone = (
        CountedShard(PointShard(range(4), 5), tmp_path / "0.npy"),
        PointShard(range(4), 5),
    )
    action = torch.full((4, ACTION), 0.5)
    assert torch.equal(shard.step(action).reward, alone.step(action).reward)
    assert torch.equal(torch.cat(shard.observe(), 1), torch.cat(alone.observe(), 1))
    assert shard.clock == 1
    state = shard.state_dict()
    assert torch.equal(state["x"], alone.state_dict()["x"])
    shard.load_state_dict(PointShard(range(4), 6).state_dict())
    assert shard.clock == 0


def test_scenes_that_begin_anew_are_refused(tmp_path: Path) -> None:
    make = counted(MakePoints(5), str(tmp_path))
    make(range(4))
    with pytest.raises(CountError, match="from 0 on began anew"):
        make(range(4))


def test_without_a_folder_nothing_is_counted() -> None:
    make = MakePoints(5)
    assert counted(make, "") is make

"""A training that stops drops the rollout or update at hand, and resumes bit for bit."""

import math
from collections.abc import Callable
from pathlib import Path

import pytest
import torch

from actors.local import LocalFleet
from learner import loop as loops
from learner.config import LoopConfig
from learner.loop import Loop
from policy.checkpoints.format import read
from policy.checkpoints.run_checkpoints import resolve
from policy.rollout import Abandoned
from tests.support.learning.loops import (
    HORIZON,
    LAYOUT,
    SCENES,
    Slowness,
    Watched,
    assert_same,
    looped,
    overlapped,
    tensors,
)
from tests.support.point_shard import PointShard

ITERATIONS = 6


class Signalled(PointShard):
    """Calls `signal` in the control step `at`, as a signal handler may at any time."""

    at = -1
    signal: Callable[[], None] = staticmethod(lambda: None)

    def step(self, action):
        if self.clock == self.at:
            self.signal()
        return super().step(action)


class SignalledStyle(Slowness):
    """Calls `signal` when it scores the batch `at`: the rollout is complete, the update is not."""

    at = -1
    signal: Callable[[], None] = staticmethod(lambda: None)

    def score(self, batch, *rest):
        if batch == self.at:
            self.signal()
        return super().score(batch, *rest)


def training(path: Path, overlap: bool, step: int = -1, batch: int = -1) -> Loop:
    """A loop that is abandoned in a control step of its clock, or before the update on a batch."""
    shards: list[Signalled] = []

    def make(owned: range) -> Signalled:
        shards.append(Signalled(owned, 5))
        return shards[-1]

    config = overlapped(ITERATIONS) if overlap else LoopConfig(iterations=ITERATIONS)
    style = SignalledStyle()
    fleet = LocalFleet(make, SCENES, 8, 2, seed=5, horizon=HORIZON)
    loop = looped(path, fleet, config, style)
    shards[0].at, shards[0].signal = step, loop.abandon
    style.at, style.signal = batch, loop.abandon
    return loop


def end(loop: Loop) -> None:
    loop.close()
    loop.fleet.close()


def numbers(path: Path) -> dict:
    """What the last checkpoint holds, but the wall time."""
    flat = tensors(read(resolve(path), layout=LAYOUT).state)
    timed = ("seconds", "world", "policy", "best_score")
    return {k: v for k, v in flat.items() if not k.endswith(timed)}


@pytest.fixture(autouse=True)
def every_update_counts_as_long(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(loops, "LONG_UPDATE_S", -1.0)
    monkeypatch.setattr(loops, "COPY_FRACTION", math.inf)


@pytest.fixture(scope="module", params=[False, True], ids=["lockstep", "overlapped"])
def whole(request, tmp_path_factory) -> tuple[bool, dict, list]:
    """An undisturbed training: whether it overlaps, its last checkpoint, its metrics."""
    path = tmp_path_factory.mktemp("whole")
    loop = training(path, request.param)
    loop.run()
    end(loop)
    return request.param, numbers(path), loop.recorder.numbers()


@pytest.mark.parametrize(
    ("step", "batch"), [(3 * HORIZON + 3, -1), (3 * HORIZON, -1), (-1, 3)], ids=str
)
def test_it_resumes_bit_for_bit(tmp_path, whole, step, batch) -> None:
    overlap, wanted, lines = whole
    loop = training(tmp_path, overlap, step, batch)
    loop.run()
    end(loop)
    done = loop.learner.version
    assert 0 < done <= 3  # overlapped, the rollout was begun during the update before it
    assert read(resolve(tmp_path), layout=LAYOUT).manifest.iteration == done
    resumed = training(tmp_path, overlap)
    resumed.load_state_dict(read(resolve(tmp_path), layout=LAYOUT).state)
    resumed.run()
    end(resumed)
    assert loop.recorder.numbers() + resumed.recorder.numbers() == lines
    assert_same(numbers(tmp_path), wanted)


def test_an_update_ends_before_its_next_gradient_step(tmp_path) -> None:
    loop = training(tmp_path, overlap=False, batch=2)
    steps = []
    step = loop.learner._critic_step
    loop.learner._critic_step = lambda *rows: steps.append(len(rows)) or step(*rows)
    loop.run()
    end(loop)
    per_update = loop.learner.config.epochs * round(SCENES * HORIZON / 128)
    assert len(steps) == 2 * per_update and loop.learner.version == 2


def test_a_short_update_is_completed(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(loops, "LONG_UPDATE_S", math.inf)
    loop = training(tmp_path, overlap=False, batch=2)
    loop.run()
    end(loop)
    assert loop.learner.version == 3 and resolve(tmp_path).name == "000003"


def test_without_a_complete_update_nothing_is_written(tmp_path) -> None:
    loop = training(tmp_path, overlap=False, step=3)
    loop.run()
    end(loop)
    assert not list(tmp_path.iterdir()) and not loop.recorder.lines


def test_a_fleet_that_cannot_end_a_rollout_completes_it(tmp_path) -> None:
    class Plain:
        """A fleet without `abandon`."""

        def __init__(self, fleet: LocalFleet) -> None:
            self.collect, self.alive = fleet.collect, fleet.alive
            self.state_dict, self.close = fleet.state_dict, fleet.close

    loop = training(tmp_path, overlap=False)
    plain = Plain(loop.fleet)
    loop.fleet = loop.gathering.fleet = plain
    loop.abandon()
    loop.run()
    end(loop)
    assert loop.learner.version == ITERATIONS


def test_a_fleet_returns_to_the_beginning_of_its_collection() -> None:
    shard = Signalled(range(8), 5)
    fleet = LocalFleet(lambda owned: shard, 8, 8, 1, seed=5, horizon=HORIZON)
    watched = Watched(fleet)
    weights = looped(Path(), fleet, LoopConfig(iterations=1)).learner.weights()
    watched.collect(weights, 0, 0.2)
    before = fleet.state_dict()["shard"]
    shard.at, shard.signal = HORIZON + 2, fleet.abandon
    with pytest.raises(Abandoned):
        watched.collect(weights, 0, 0.2)
    assert shard.clock == HORIZON + 3  # the step at hand is the last one
    fleet.rewind()
    after = fleet.state_dict()["shard"]
    assert all(torch.equal(after[name], before[name]) for name in before)
    fleet.close()

"""Overlapped mode: which policy acts, what is dropped and counted, and exact resume."""

from dataclasses import dataclass, field, replace

import pytest
import torch

from actors.cluster import ray_session
from actors.fleet import FleetConfig, RayFleet
from actors.local import LocalFleet
from console.run.experiment import Experiment, check
from learner.config import LagConfig, LoopConfig
from learner.errors import TrainingError
from learner.loop import MAX_STALE_ROLLOUTS, Loop
from policy.checkpoints.format import read
from policy.checkpoints.run_checkpoints import resolve
from policy.rollout import Rollout
from tests.support.faulty_shard import MakePoints
from tests.support.learning.loops import (
    HORIZON,
    LAYOUT,
    SAMPLES,
    SCENES,
    Scores,
    Slowness,
    Watched,
    assert_same,
    looped,
    overlapped,
    points,
    tensors,
)
from world.errors import ConfigError


class Late(Watched):
    """Gives rollouts of a version as many updates old as `behind` says, one after the other."""

    def __init__(self, fleet: LocalFleet, behind: list[int]) -> None:
        super().__init__(fleet)
        self.behind = behind

    def collect(self, weights, version, sigma) -> Rollout:
        rollout = super().collect(weights, version, sigma)
        late = self.behind.pop(0) if self.behind else 0
        return replace(rollout, version=version - late)


@dataclass
class Behind(Slowness):
    """Scores with a discriminator as old as `late` says, one batch after the other."""

    late: list[int]
    batches: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__init__()

    def score(self, batch, rollout_states, end_index, end_states, valid) -> Scores:
        self.batches.append(batch)
        found = super().score(batch, rollout_states, end_index, end_states, valid)
        return replace(found, version=self.version - (self.late.pop(0) if self.late else 0))

    def train(self, version: int) -> dict[str, float]:
        return super().train(self.version)


def finished(loop: Loop, state: dict | None = None) -> dict:
    """Run to the end; what a checkpoint then holds, but the wall time."""
    if state is not None:
        loop.load_state_dict(state)
    loop.run()
    flat = tensors(loop.state_dict())
    loop.close()
    loop.fleet.close()
    return {
        k: v
        for k, v in flat.items()
        if not k.endswith(("seconds", "alive", "world", "policy", "best_score"))
    }


def test_the_first_update_is_lockstep_s_and_the_second_is_not(tmp_path):
    found = []
    for name, config in (("ahead", overlapped(2)), ("lockstep", LoopConfig(iterations=2))):
        loop = looped(tmp_path / name, points(), config)
        weights = []
        for _ in range(2):
            loop.iterate()
            weights.append(loop.learner.critic.head.weight.clone())
        found.append(weights)
        loop.close()
        loop.fleet.close()
    (first, second), (same, other) = found
    assert torch.equal(first, same) and not torch.equal(second, other)


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> dict:
    """Seven overlapped iterations in one go."""
    loop = looped(tmp_path_factory.mktemp("whole"), points(), overlapped(7), Slowness())
    return finished(loop)


@pytest.mark.parametrize("stop", [1, 4])
def test_resumed_equals_uninterrupted_bit_for_bit(tmp_path, whole, stop):
    finished(looped(tmp_path, points(), overlapped(stop), Slowness()))
    kept = read(resolve(tmp_path), layout=LAYOUT).state
    assert kept["training"]["waiting"]["rollout"]["version"] == stop - 1
    resumed = looped(tmp_path, points(3), overlapped(7), Slowness())
    assert_same(finished(resumed, kept), whole)
    lines = resumed.recorder.lines
    assert [m["lag/policy"] for _, m in lines] == [1] * (7 - stop)


def test_checkpoints_under_way_change_nothing(tmp_path, whole):
    config = overlapped(7, checkpoint_iterations=2)
    assert_same(finished(looped(tmp_path, points(), config, Slowness())), whole)


def test_lockstep_refuses_what_was_begun_ahead_and_takes_the_rest(tmp_path):
    finished(looped(tmp_path / "ahead", points(), overlapped(2)))
    kept = read(resolve(tmp_path / "ahead"), layout=LAYOUT).state
    loop = looped(tmp_path / "on", points(), LoopConfig(iterations=3))
    with pytest.raises(
        TrainingError, match=r"begun ahead \(--lag\.overlap\): resume with --lag\.overlap"
    ):
        loop.load_state_dict(kept)
    loop.close()
    loop.fleet.close()
    finished(looped(tmp_path / "lockstep", points(), LoopConfig(iterations=2)))
    kept = read(resolve(tmp_path / "lockstep"), layout=LAYOUT).state
    assert "waiting" not in kept["training"]
    loop = looped(tmp_path / "further", points(), overlapped(4))
    finished(loop, kept)
    assert [m["lag/policy"] for _, m in loop.recorder.lines] == [0, 1]


def test_real_ray_gives_the_same_bits_also_when_an_actor_is_killed(tmp_path, whole):
    make = MakePoints(fault="kill", at=30, once=tmp_path / "killed")
    with ray_session(cpus=2, object_store_bytes=100 * 2**20):
        config = FleetConfig(start_s=120, rollout_s=60, restarts=1)
        fleet = RayFleet(make, SCENES, 8, 2, seed=5, horizon=HORIZON, config=config)
        loop = looped(tmp_path / "ray", fleet, overlapped(7), Slowness())
        assert_same(finished(loop), whole)
    assert (tmp_path / "killed").exists() and fleet.restarts == 1


@pytest.mark.parametrize("overlap", [False, True])
def test_rollouts_beyond_the_bound_are_dropped_and_counted(tmp_path, overlap):
    # Of seven rollouts the second, third and sixth are two updates old. Overlapped, one begun
    # before an update is one old by itself; one begun after a drop is not.
    fleet = Late(points(), [0, 1, 2, 0, 0, 1, 0] if overlap else [0, 2, 2, 0, 0, 2, 0])
    style = Behind([])
    loop = looped(tmp_path, fleet, LoopConfig(iterations=4, lag=LagConfig(overlap)), style)
    loop.run()
    lines = [metrics for _, metrics in loop.recorder.lines]
    assert [m["dropped/samples"] for m in lines] == [0, 2 * SAMPLES, 0, SAMPLES]
    assert lines[-1]["samples"] == 4 * SAMPLES, "what was dropped was not learned from"
    assert style.batches == [0, 1, 2, 3], "nor did the discriminator see it"
    assert max(m["lag/policy"] for m in lines) <= 1
    collected = 7 + overlap
    assert len(fleet.gave) == collected
    loop.close()
    fleet.close()


def test_batches_scored_by_an_old_discriminator_are_dropped_and_counted(tmp_path):
    style = Behind([0, 2, 0, 1, 2, 0])
    loop = looped(tmp_path, points(), LoopConfig(iterations=4), style)
    loop.run()
    lines = [metrics for _, metrics in loop.recorder.lines]
    assert [m["dropped/samples"] for m in lines] == [0, SAMPLES, 0, SAMPLES]
    assert [m["lag/style"] for m in lines] == [0, 0, 1, 0]
    assert style.batches == [0, 1, 2, 3, 4, 5], "a batch that is scored anew has another id"
    assert loop.state_dict()["training"]["batches"] == 6
    loop.close()
    loop.fleet.close()


def test_a_fleet_that_always_lags_ends_the_run_with_one_line(tmp_path):
    fleet = Late(points(), [9] * 99)
    loop = looped(tmp_path, fleet, LoopConfig(iterations=3, lag=LagConfig(max_policy=2)))
    with pytest.raises(TrainingError, match=r"^iteration 1: 8 rollouts .* --lag\.max-policy 2 or"):
        loop.run()
    assert len(fleet.gave) == MAX_STALE_ROLLOUTS
    loop.close()
    fleet.close()


def test_settings_that_contradict_one_another():
    with pytest.raises(ConfigError, match=r"which --lag\.max-policy 0 drops"):
        check(Experiment(lag=LagConfig(overlap=True, max_policy=0)))
    with pytest.raises(ConfigError, match="must be 0 or above"):
        check(Experiment(lag=LagConfig(max_style=-1)))
    assert check(Experiment(lag=LagConfig(overlap=True))).lag.overlap

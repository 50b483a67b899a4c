"""Stand-ins for actors send what actors would, when actors would."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest
import ray
import torch

from actors.cluster import ray_session
from console.bench import scaling
from console.bench.stand_in_fleet import SleepingFleet, sleepers
from learner.config import LagConfig, LearnerConfig, LoopConfig
from learner.loop import Loop
from learner.ppo import Learner
from policy.rollout import Rollout
from tests.support.console.stand_ins import weights
from tests.support.learning.loops import Memory
from tests.support.point_shard import ACTION, GOAL, STATE
from world.precision import FLOAT32


@pytest.fixture(scope="module")
def hosts(part: Rollout) -> Iterator[list[Any]]:
    with ray_session(cpus=2, object_store_bytes=100 * 2**20), sleepers(part, 2) as found:
        yield found


def assert_same(got: Rollout, wanted: Rollout) -> None:
    for name, tensor in wanted.tensors().items():
        assert torch.equal(got.tensors()[name], tensor), name


def test_stand_ins_send_what_actors_would(hosts: list[Any], part: Rollout) -> None:
    fleet = SleepingFleet(hosts, part, 70, 0.01)
    got = fleet.collect(weights(3), 3, 0.1)
    assert got.seconds == {"world": 0.01, "policy": 0.0}
    assert (got.version, got.samples, fleet.samples) == (3, 70 * part.samples, 70 * part.samples)
    assert_same(got, Rollout.join([replace(part, first_scene=8 * i) for i in range(70)]))


def test_prefetched_stand_ins_do_not_wait_for_the_learner(
    hosts: list[Any], part: Rollout, monkeypatch: pytest.MonkeyPatch
) -> None:
    fleet = SleepingFleet(hosts, part, 6, 0.5)
    first = fleet.request(weights(0), 0)
    fleet.prefetch(weights(1), 1, 0.1)
    fleet.receive(first)
    there, missing = ray.wait(fleet._requested, num_returns=len(fleet._requested))
    assert len(there) == 6 and not missing
    monkeypatch.setattr(fleet, "request", lambda *_: pytest.fail("it was there already"))
    assert fleet.collect(weights(1), 1, 0.1).version == 1


def test_bench_overlaps_the_stand_ins(hosts: list[Any], part: Rollout) -> None:
    learning = LearnerConfig(hidden=(16, 16), warmup_iterations=0, minibatch=64)
    fleet = SleepingFleet(hosts, part, 4, 0.0)
    lags = []
    for overlap in (False, True):
        loop = Loop(
            Learner(STATE + GOAL, ACTION, learning, precision=FLOAT32),
            fleet,
            None,
            Memory(),
            Memory(),
            LoopConfig(lag=LagConfig(overlap)),
        )
        lines = scaling.iterations(loop, 0.0)
        loop.close()
        lags.append([line["lag/policy"] for line in lines])
        assert {line["samples"] for line in lines} == {
            float(i * fleet.samples) for i in range(3, 7)
        }
    assert lags == [[0.0] * 4, [1.0] * 4]

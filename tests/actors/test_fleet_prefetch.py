"""Prefetched rollouts: actors begin with them without waiting, and the bits are the same."""

import os
import signal
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
import ray as ray_api

from actors.cluster import ray_session
from actors.collection import Job, PublishedPolicy
from actors.division import state_of_scenes
from actors.fleet import FleetConfig, RayFleet
from actors.local import LocalFleet
from learner.gathering import Gathering
from policy.rollout import Rollout
from tests.support.faulty_shard import MakePoints, MakeSlowPoints
from tests.support.learning.fleets import BLOCK, HORIZON, SCENES, SIGMA, assert_same, weights

ROLLOUTS = 7
CONFIG = FleetConfig(start_s=120, rollout_s=60, restarts=2)


class Counting(RayFleet):
    """Counts the prefetched parts that are used."""

    taken = 0

    def _take_prefetched(self, *asked: Any) -> tuple[PublishedPolicy, list[Job]]:
        policy, prefetched = super()._take_prefetched(*asked)
        self.taken += len(prefetched)
        return policy, prefetched


@pytest.fixture(scope="module", autouse=True)
def ray():
    with ray_session(cpus=3, object_store_bytes=100 * 2**20):
        yield


def rayed(make: Any, workers: int, config: FleetConfig = CONFIG) -> Counting:
    return Counting(make, SCENES, BLOCK, workers, seed=5, horizon=HORIZON, config=config)


def run(fleet: Any, between: Callable[[int], None] = lambda version: None) -> list[Rollout]:
    """As an overlapped run has them; `between`: what happens after each was handed out."""
    gathering, got = Gathering(fleet, overlap=True), []
    for version in range(ROLLOUTS):
        got.append(gathering.next(weights(version), version, SIGMA).rollout)
        between(version)
    gathering.close()
    return got


@pytest.fixture(scope="module")
def wanted() -> list[Rollout]:
    fleet = LocalFleet(MakePoints(), SCENES, BLOCK, 1, seed=5, horizon=HORIZON)
    rollouts = run(fleet)
    fleet.close()
    assert [rollout.version for rollout in rollouts] == [0, 0, 1, 2, 3, 4, 5]
    return rollouts


def slow(folder: Path, scene_s: float) -> MakeSlowPoints:
    """Actors as slow as each other."""
    (folder / "nobody").write_text("0")
    return MakeSlowPoints(folder / "nobody", scene_s=scene_s)


@pytest.mark.parametrize("workers", [1, 3])
def test_prefetched_rollouts_have_the_same_bits(workers, tmp_path, wanted) -> None:
    fleet = rayed(slow(tmp_path, 0.5e-3), workers)
    assert_same(run(fleet, lambda version: time.sleep(0.03)), wanted)
    # In the first collection they may not have been asked yet when they are told.
    assert fleet.taken >= workers * (ROLLOUTS - 1) and fleet.restarts == 0
    fleet.close()


def test_actors_do_not_wait_for_the_collection_of_all_parts(tmp_path) -> None:
    fleet = rayed(slow(tmp_path, 2.5e-3), 2)  # 24 scenes and 8 steps: 0.48 s
    with ThreadPoolExecutor(1) as pool:
        first = pool.submit(fleet.collect, weights(0), 0, SIGMA)
        time.sleep(0.2)
        then = weights(1)
        fleet.prefetch(then, 1, SIGMA)
        first.result()
        # The learner takes its time; then no actor can do any more.
        there, missing = ray_api.wait([job.reference for job in fleet._prefetched], num_returns=2)
        assert len(there) == 2 and not missing
        for pid in fleet.pids():
            os.kill(pid, signal.SIGSTOP)
        try:
            second = pool.submit(fleet.collect, then, 1, SIGMA).result(60)
        finally:
            for pid in fleet.pids():
                os.kill(pid, signal.SIGCONT)
    assert second.version == 1, "it was there already"
    fleet.close()


def test_prefetch_during_requests(tmp_path, monkeypatch) -> None:
    """What comes next is never queued before what it goes on from."""
    fleet = rayed(slow(tmp_path, 0.5e-3), 2)
    alone = LocalFleet(MakePoints(), SCENES, BLOCK, 1, seed=5, horizon=HORIZON)
    got = [fleet.collect(weights(0), 0, SIGMA)]
    fleet.load_state_dict(fleet.state_dict())  # each actor is to be sent its state again
    began = threading.Event()

    def slowly(*of: Any) -> Any:
        began.set()
        time.sleep(0.2)
        return state_of_scenes(*of)

    monkeypatch.setattr("actors.fleet.state_of_scenes", slowly)
    with ThreadPoolExecutor(1) as pool:
        second = pool.submit(fleet.collect, weights(1), 1, SIGMA)
        assert began.wait(60)
        then = weights(2)
        fleet.prefetch(then, 2, SIGMA)
        got += [second.result(), fleet.collect(then, 2, SIGMA)]
    assert_same(got, [alone.collect(weights(k), k, SIGMA) for k in range(3)])
    for held in (fleet, alone):
        held.close()


def test_prefetch_of_another_policy(tmp_path) -> None:
    """What was begun is dropped, and begun again from the right state."""
    fleet = rayed(slow(tmp_path, 0.5e-3), 2)
    alone = LocalFleet(MakePoints(), SCENES, BLOCK, 1, seed=5, horizon=HORIZON)
    with ThreadPoolExecutor(1) as pool:
        first = pool.submit(fleet.collect, weights(0), 0, SIGMA)
        time.sleep(0.02)
        fleet.prefetch(weights(1), 1, SIGMA)
        got = [first.result(), fleet.collect(weights(2), 2, SIGMA)]
        assert_same(got, [alone.collect(weights(k), k, SIGMA) for k in (0, 2)])
        # And where the scenes are put elsewhere in between.
        kept = alone.state_dict()
        second = pool.submit(fleet.collect, weights(3), 3, SIGMA)
        time.sleep(0.02)
        then = weights(4)
        fleet.prefetch(then, 4, SIGMA)
        second.result()
        fleet.load_state_dict(kept)
        assert_same([fleet.collect(then, 4, SIGMA)], [alone.collect(then, 4, SIGMA)])
    for held in (fleet, alone):
        held.close()


@pytest.mark.parametrize("fault", ["kill", "raise", "hang"])
def test_a_failure_with_a_prefetched_part_in_the_queue(fault, tmp_path, wanted) -> None:
    config = FleetConfig(start_s=120, rollout_s=5, restarts=2)
    make = MakePoints(fault=fault, at=3 * HORIZON - 3, once=tmp_path / fault)
    fleet = rayed(make, 3, config)
    assert_same(run(fleet, lambda version: time.sleep(0.05)), wanted)
    assert (tmp_path / fault).exists()
    assert fleet.restarts == 1 or fault == "hang"
    fleet.close()


def test_killed_at_any_moment(tmp_path, wanted) -> None:
    fleet = rayed(slow(tmp_path, 0.5e-3), 3)

    def kill(version: int) -> None:
        if version in (1, 3):
            time.sleep(0.03 * version)
            os.kill(fleet.pids()[version % 3], signal.SIGKILL)

    assert_same(run(fleet, kill), wanted)
    assert fleet.restarts == 2
    fleet.close()

"""Actors that stop, lag or poison: others deliver the same bits, and parts follow the speeds."""

import os
import signal
import time
from pathlib import Path

import pytest

from actors.cluster import ray_session
from actors.errors import FleetError
from actors.fleet import FleetConfig, RayFleet
from actors.local import LocalFleet
from policy.rollout import Rollout
from tests.support.faulty_shard import MakePoints, MakeSlowPoints
from tests.support.learning.fleets import (
    BLOCK,
    HORIZON,
    SCENES,
    SIGMA,
    assert_same,
    run,
    weights,
)

ROLLOUTS = 8
#: No rollout may be waited for until its deadline, which lies beyond the test's own.
CONFIG = FleetConfig(start_s=120, rollout_s=600, restarts=2)


@pytest.fixture(scope="module", autouse=True)
def ray():
    with ray_session(cpus=4, object_store_bytes=100 * 2**20):
        yield


def rayed(make, workers: int, config: FleetConfig = CONFIG) -> RayFleet:
    return RayFleet(make, SCENES, BLOCK, workers, seed=5, horizon=HORIZON, config=config)


@pytest.fixture(scope="module")
def undisturbed() -> list[Rollout]:
    fleet = LocalFleet(MakePoints(), SCENES, BLOCK, 1, seed=5, horizon=HORIZON)
    rollouts = [fleet.collect(weights(v), v, SIGMA) for v in range(ROLLOUTS)]
    fleet.close()
    return rollouts


def test_stopped_in_the_middle_and_continued(tmp_path, undisturbed):
    """SIGSTOP: the others take over; the same process goes on later, and has work again."""
    once = tmp_path / "stopped"
    fleet = rayed(MakePoints(fault="stop", at=13, once=once), 3)
    stopped = fleet.pids()[0]
    try:
        got = run(fleet, range(4))
        assert once.exists() and _state(stopped) == "T"
        assert fleet.stragglers >= 1 and fleet.restarts == 0
        assert fleet.division()[0] == 0 and sum(fleet.division()) == SCENES
        os.kill(stopped, signal.SIGCONT)
        got += [fleet.collect(weights(v), v, SIGMA) for v in range(4, ROLLOUTS)]
        assert_same(got, undisturbed)
        until = time.monotonic() + 120
        while fleet.division()[0] == 0:
            assert time.monotonic() < until, "it must get work again"
            fleet.collect(weights(ROLLOUTS), ROLLOUTS, SIGMA)
        assert fleet.pids()[0] == stopped and fleet.restarts == 0
    finally:
        os.kill(stopped, signal.SIGCONT)
        fleet.close()


def _state(pid: int) -> str:
    """R running, S sleeping, T stopped."""
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]


def test_a_straggler_costs_at_most_its_own_share(tmp_path, undisturbed):
    """Ten times slower than two others: soon it has nothing to do, and they share its scenes."""
    fleet = rayed(MakeSlowPoints(tmp_path / "slow", scene_s=3e-3), 3)
    slow = int((tmp_path / "slow").read_text())
    got = run(fleet, range(ROLLOUTS))
    assert_same(got, undisturbed)
    # Six blocks, of costs 1, 1 and 10: three each is done at 3, with one for the third at 10.
    for _ in range(30):
        if dict(zip(fleet.pids(), fleet.division(), strict=True))[slow] == 0:
            break
        fleet.collect(weights(ROLLOUTS), ROLLOUTS, SIGMA)
    division = dict(zip(fleet.pids(), fleet.division(), strict=True))
    assert division[slow] == 0 and sum(division.values()) == SCENES
    assert fleet.restarts == 0 and fleet.alive() == 3
    fleet.close()


def test_scenes_that_kill_whoever_touches_them_end_the_run():
    fleet = rayed(MakePoints(fault="kill", at=13), 2)
    with pytest.raises(FleetError, match=r"^actor \d \(scenes .*\) failed 3 times in a row: its"):
        for version in range(3):
            fleet.collect(weights(version), version, SIGMA)
    fleet.close()

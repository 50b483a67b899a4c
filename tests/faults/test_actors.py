"""Actors that stop, lag or poison: others deliver the same bits, and parts follow the speeds."""

import os
import signal
import time
from pathlib import Path

import pytest

from actors.cluster import ray_session
from actors.collection import Collection
from actors.errors import FleetError
from actors.fleet import FleetConfig, RayFleet
from actors.local import LocalFleet
from actors.shares import consecutive, longest, shares
from policy.rollout import Rollout
from tests.actors.test_fleet import (
    BLOCK,
    HORIZON,
    RECOVERY_S,
    SCENES,
    SIGMA,
    assert_same,
    run_timed,
    weights,
)
from tests.support.faulty_shard import MakePoints, MakeSlowPoints

ROLLOUTS = 8
CONFIG = FleetConfig(start_s=120, rollout_s=60, restarts=2)


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
        got, took = run_timed(fleet, range(4))
        assert max(took) < RECOVERY_S
        assert once.exists() and _state(stopped) == "T"
        assert fleet.helped >= 1 and fleet.restarts == 0
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
    got, _ = run_timed(fleet, range(ROLLOUTS))
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


def test_shares_by_hand():
    assert shares(32, [1.0, 1.0, 1.0, 1.0]) == [8, 8, 8, 8]
    assert shares(7, [1.0, 1.0, 1.0]) == [3, 2, 2]
    # Rates 1, 1, 1 and 1/10: the last one has one block when the others have ten.
    assert shares(32, [1.0, 1.0, 1.0, 10.0]) == [11, 10, 10, 1]
    assert longest([11, 10, 10, 1], [1.0, 1.0, 1.0, 10.0]) == 11.0
    assert shares(6, [10.0, 1.0, 1.0]) == [0, 3, 3]
    assert consecutive([2, 0, 1], 8) == [range(16), range(16, 16), range(16, 24)]


@pytest.mark.parametrize("actors", [2, 4, 10])
def test_a_tenth_of_the_speed_is_no_dearer_than_no_actor(actors):
    """By enumeration of all divisions that give the others the same: none is done earlier."""
    costs = [10.0] + [1.0] * (actors - 1)
    blocks = 8 * actors
    best = min(longest([own, *_even(blocks - own, actors - 1)], costs) for own in range(blocks + 1))
    found = longest(shares(blocks, costs), costs)
    assert found == best <= max(_even(blocks, actors - 1))


def _even(blocks: int, actors: int) -> list[int]:
    return [blocks // actors + (i < blocks % actors) for i in range(actors)]


class TestCollection:
    """Every scene once, whoever delivers, dies or is late: on eight blocks of one scene."""

    def collection(self) -> Collection:
        found = Collection(range(8), 1, late_s=10.0, late_factor=2.0)
        found.ask("a", "A", range(4))
        found.ask("b", "B", range(4, 8))
        found.owe_the_rest()
        assert not found.owed
        return found

    def deliver(self, asked: Collection, reference: str) -> bool:
        return asked.answer(asked.jobs[reference], {"of": reference}, {})

    def taken(self, asked: Collection) -> dict[range, str]:
        return {scenes: packed["of"] for scenes, (packed, _) in asked.results.items()}

    def test_what_a_dead_actor_had_is_owed_in_parts(self):
        asked = self.collection()
        assert asked.fail(asked.jobs["a"]) == 1
        assert asked.take(helpers=3) == (range(2), 1)
        assert asked.take(helpers=1) == (range(2, 4), 1)
        assert not asked.owed and not asked.complete

    def test_a_late_original_replaces_pieces_and_later_ones_do_not_count(self):
        asked = self.collection()
        self.deliver(asked, "b")
        asked.look_for_late(time.monotonic() + 5)
        assert not asked.owed, "late only after 10 s"
        asked.look_for_late(time.monotonic() + 11)
        assert asked.take(2) == (range(2), 0)
        asked.ask("a1", "B", range(2))
        assert self.deliver(asked, "a1")
        assert self.taken(asked) == {range(4, 8): "b", range(2): "a1"}
        asked.ask("a2", "B", asked.take(1)[0])
        assert self.deliver(asked, "a")
        assert self.taken(asked) == {range(4, 8): "b", range(4): "a"} and asked.complete
        assert not self.deliver(asked, "a2")
        assert asked.complete and asked.helped == 1

    def test_a_helper_that_dies_leaves_its_piece_owed_though_the_late_one_is_at_it(self):
        asked = self.collection()
        self.deliver(asked, "b")
        asked.look_for_late(time.monotonic() + 11)
        asked.ask("a1", "B", asked.take(1)[0])
        assert asked.fail(asked.jobs["a1"]) == 1
        assert asked.owed == [(range(4), 1)]
        asked.ask("a1", "B", *asked.take(1))
        assert asked.fail(asked.jobs["a1"]) == 2
        asked.fail(asked.jobs["a"])
        assert asked.owed == [(range(4), 2)], "not twice"

    def test_none_is_late_as_long_as_most_are_at_work(self):
        asked = self.collection()
        assert asked.late_at_s is None
        self.deliver(asked, "b")
        assert asked.late_at_s is not None

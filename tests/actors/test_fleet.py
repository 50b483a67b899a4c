"""Ray actors give the local fleet's bits: undisturbed, killed, hung; and a crash loop ends."""

import os
import signal

import pytest
import torch

from actors.cluster import ray_session
from actors.errors import FleetError
from actors.fleet import FleetConfig
from actors.local import LocalFleet
from policy.errors import LayoutError
from policy.rollout import Abandoned
from tests.support.faulty_shard import MakePoints
from tests.support.learning.fleets import (
    BLOCK,
    HORIZON,
    assert_same,
    gone,
    local,
    rayed,
    run,
    until_whole,
)
from world.errors import ConfigError


@pytest.fixture(scope="module", autouse=True)
def ray():
    with ray_session(cpus=3, object_store_bytes=100 * 2**20):
        yield


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_same_bits_as_the_local_fleet(workers, undisturbed):
    fleet = rayed(workers)
    assert_same(run(fleet), undisturbed)
    assert fleet.alive() == workers and fleet.restarts == 0
    pids = fleet.pids()
    assert len(set(pids)) == workers and os.getpid() not in pids
    fleet.close()
    assert gone(pids)


def test_killed_in_the_middle_of_a_rollout(tmp_path, undisturbed):
    fleet = rayed(2, MakePoints(fault="kill", at=13, once=tmp_path / "killed"))
    got = run(fleet)
    assert_same(got, undisturbed)
    assert (tmp_path / "killed").exists() and fleet.restarts == 1
    until_whole(fleet, 2)
    fleet.close()


def test_killed_between_rollouts_and_both_at_once(undisturbed):
    fleet = rayed(2)
    got = run(fleet, range(2))
    dead = fleet.pids()
    for pid in dead:
        os.kill(pid, signal.SIGKILL)
    got += run(fleet, range(2, 4))
    assert fleet.restarts == 2
    assert_same(got, undisturbed)
    until_whole(fleet, 2)
    assert gone(dead) and not set(dead) & set(fleet.pids())
    fleet.close()


def test_killed_before_the_first_rollout(undisturbed):
    fleet = rayed(1)
    os.kill(fleet.pids()[0], signal.SIGKILL)
    assert_same(run(fleet), undisturbed)
    fleet.close()


def test_hung_alone_is_replaced_at_its_deadline(tmp_path, undisturbed):
    once = tmp_path / "hung"
    config = FleetConfig(start_s=60, rollout_s=3, restarts=1)
    fleet = rayed(1, MakePoints(fault="hang", at=13, once=once), config)
    hung = fleet.pids()[0]
    assert_same(run(fleet), undisturbed)
    assert once.exists() and fleet.restarts == 1
    assert gone([hung]), "the hung process must not stay"
    fleet.close()


def test_transient_error_is_mended(tmp_path, undisturbed):
    fleet = rayed(1, MakePoints(fault="raise", at=13, once=tmp_path / "raised"))
    assert_same(run(fleet), undisturbed)
    assert fleet.restarts == 1
    fleet.close()


@pytest.mark.parametrize(
    ("fault", "cause"),
    [
        ("raise", "ArithmeticError: the seat fell through the floor"),
        ("kill", "its process died (killed, out of memory, or crashed)"),
    ],
)
def test_crash_loop_ends_with_its_cause(fault, cause):
    fleet = rayed(1, MakePoints(fault=fault, at=3))
    with pytest.raises(FleetError) as caught:
        run(fleet)
    assert str(caught.value) == f"actor 0 (scenes 0 to 47) failed 2 times in a row: {cause}"
    pids = fleet.pids()
    fleet.close()
    assert gone(pids)


def test_a_wrong_setting_is_reported_at_once_and_as_such():
    with pytest.raises(ConfigError, match=r"^no such chair: choose one of chair, stool$"):
        rayed(1, MakePoints(fault="misconfigured"))


def test_checkpoint_moves_between_runners_and_numbers_of_actors(undisturbed):
    three, there, one = local(3), rayed(2), local(1)
    run(three, range(2))
    there.load_state_dict(three.state_dict())
    assert_same(run(there, range(2, 3)), undisturbed[2:3])
    one.load_state_dict(there.state_dict())
    assert_same(run(one, range(3, 4)), undisturbed[3:])
    small = LocalFleet(MakePoints(), 16, BLOCK, 1, seed=5, horizon=HORIZON)
    with pytest.raises(LayoutError, match="of 16 scenes, this fleet has 48"):
        there.load_state_dict(small.state_dict())
    for fleet in (three, there, one, small):
        fleet.close()


def test_an_abandoned_collection_ends_and_its_scenes_return():
    fleet = rayed(2)
    run(fleet, range(1))
    before = fleet.state_dict()["shard"]
    run(fleet, range(1, 2))
    fleet.rewind()
    fleet.abandon()
    with pytest.raises(Abandoned):
        run(fleet, range(1, 2))
    fleet.rewind()
    after = fleet.state_dict()["shard"]
    assert all(torch.equal(after[name], before[name]) for name in before)
    fleet.close()

"""Local processes give the threads' bits; errors surface, and a dead one is one clear line."""

import os
import signal
import time

import pytest
import torch

from actors.errors import FleetError
from actors.local import LocalFleet
from actors.processes import ProcessFleet
from policy.model.acting import publish
from policy.model.networks import Actor
from policy.model.normaliser import Normaliser
from policy.rollout import Abandoned, Rollout
from tests.support.faulty_shard import MakePoints
from tests.support.point_shard import ACTION, GOAL, STATE
from world.errors import ConfigError

SCENES, BLOCK, HORIZON = 48, 8, 8


def weights() -> dict[str, torch.Tensor]:
    torch.manual_seed(0)
    actor, normaliser = Actor(STATE + GOAL, ACTION, (16, 16)), Normaliser(STATE + GOAL)
    with torch.no_grad():
        actor.layers[-1].weight.mul_(300)
    return publish(actor, normaliser)


def processes(workers: int, make: MakePoints | None = None) -> ProcessFleet:
    return ProcessFleet(make or MakePoints(), SCENES, BLOCK, workers, seed=5, horizon=HORIZON)


def assert_same(one: Rollout, other: Rollout) -> None:
    for name, tensor in one.tensors().items():
        assert torch.equal(tensor, other.tensors()[name]), name


def test_processes_give_the_numbers_of_threads_and_go_on_from_their_state():
    threads = LocalFleet(MakePoints(), SCENES, BLOCK, 1, seed=5, horizon=HORIZON)
    held = processes(3)
    try:
        for version in range(3):
            wanted = threads.collect(weights(), version, 0.2)
            got = held.collect(weights(), version, 0.2)
            assert_same(got, wanted)
            assert got.version == version
        assert len(wanted.end_index) > 0, "episodes must have ended for the test to mean much"
        state = threads.state_dict()
        for name, tensor in held.state_dict()["shard"].items():
            assert torch.equal(tensor, state["shard"][name]), name
        wanted = threads.collect(weights(), 3, 0.2)
        held.collect(weights(), 3, 0.4)  # astray, and back
        held.load_state_dict(state)
        assert_same(held.collect(weights(), 3, 0.2), wanted)
    finally:
        held.close()
        threads.close()


def test_an_error_of_a_worker_surfaces_as_itself_and_ends_no_other():
    held = processes(3, MakePoints(fault="raise", at=3))
    with pytest.raises(ArithmeticError, match="the seat fell through the floor"):
        held.collect(weights(), 0, 0.2)
    assert held.alive() == 3
    held.close()
    wrong = processes(2, MakePoints(fault="misconfigured"))
    with pytest.raises(ConfigError, match="choose one of chair, stool"):
        wrong.ready()
    wrong.close()


def test_workers_build_while_the_caller_goes_on(monkeypatch):
    """Nothing is waited for until the first call, and the answers are taken once."""
    answered = []
    taken = ProcessFleet._answer

    def counted(self, index):
        answered.append(index)
        return taken(self, index)

    monkeypatch.setattr(ProcessFleet, "_answer", counted)
    held = processes(3)
    try:
        assert answered == []
        held.ready()
        held.ready()
        assert answered == [0, 1, 2]
        held.collect(weights(), 0, 0.2)
        assert answered == [0, 1, 2] * 2
    finally:
        held.close()


def test_a_killed_worker_is_one_clear_line():
    held = processes(2, MakePoints(fault="kill", at=5))
    with pytest.raises(FleetError, match=r"actor 0 \(scenes 0 to 23\) died, exit code -9") as told:
        held.collect(weights(), 0, 0.2)
    assert "--resume" in str(told.value) and "\n" not in str(told.value)
    assert held.alive() == 1
    held.close()
    idle = processes(2)
    os.kill(idle.pids()[1], signal.SIGKILL)
    with pytest.raises(FleetError, match="actor 1"):
        for _ in range(2):  # the first request may still find its pipe open
            idle.collect(weights(), 0, 0.2)
    idle.close()


def test_workers_outlive_neither_close_nor_an_interrupt():
    held = processes(2)
    pids = held.pids()
    held.ready()
    for pid in pids:
        os.kill(pid, signal.SIGINT)  # Ctrl-C reaches them too: the learner decides
    held.collect(weights(), 0, 0.2)
    held.close()
    until = time.monotonic() + 20
    while any(os.path.exists(f"/proc/{pid}") for pid in pids):
        assert time.monotonic() < until
        time.sleep(0.05)


def test_an_abandoned_collection_ends_and_its_scenes_return():
    held = processes(2)
    try:
        held.collect(weights(), 0, 0.2)
        before = held.state_dict()["shard"]
        held.collect(weights(), 1, 0.2)
        held.rewind()
        held.abandon()
        with pytest.raises(Abandoned):
            held.collect(weights(), 1, 0.2)
        held.rewind()
        after = held.state_dict()["shard"]
        assert all(torch.equal(after[name], before[name]) for name in before)
        assert held.alive() == 2
    finally:
        held.close()

"""Ray actors give the local fleet's bits: undisturbed, killed, hung; and a crash loop ends."""

import os
import signal
import time
from pathlib import Path

import pytest
import torch

from actors.cluster import ClusterError, ray_session
from actors.errors import FleetError
from actors.fleet import FleetConfig, RayFleet
from actors.local import LocalFleet
from actors.ray_actor import pack_rollout, unpack_rollout
from policy.errors import LayoutError
from policy.model.acting import publish
from policy.model.networks import Actor
from policy.model.normaliser import Normaliser
from policy.rollout import Rollout
from tests.support.faulty_shard import MakePoints
from tests.support.point_shard import ACTION, GOAL, STATE
from world.errors import ConfigError

SCENES, BLOCK, HORIZON, SIGMA = 48, 8, 8, 0.2
ROLLOUTS = 4
RECOVERY_S = 10.0
"""From a fault to the numbers that it held up, where others are there to deliver them."""
SOUND = MakePoints()
QUICK = FleetConfig(start_s=60, rollout_s=30, restarts=1)


@pytest.fixture(scope="module", autouse=True)
def ray():
    with ray_session(cpus=3, object_store_bytes=100 * 2**20):
        yield


def weights(version: int) -> dict[str, torch.Tensor]:
    """Another policy each iteration, as in training."""
    torch.manual_seed(version)
    actor, normaliser = Actor(STATE + GOAL, ACTION, (16, 16)), Normaliser(STATE + GOAL)
    with torch.no_grad():
        actor.layers[-1].weight.mul_(300)
    return publish(actor, normaliser)


def rayed(workers: int, make: MakePoints = SOUND, config: FleetConfig = QUICK) -> RayFleet:
    return RayFleet(make, SCENES, BLOCK, workers, seed=5, horizon=HORIZON, config=config)


def local(workers: int = 1) -> LocalFleet:
    return LocalFleet(MakePoints(), SCENES, BLOCK, workers, seed=5, horizon=HORIZON)


def run(fleet: LocalFleet | RayFleet, versions: range = range(ROLLOUTS)) -> list[Rollout]:
    return [fleet.collect(weights(v), v, SIGMA) for v in versions]


def assert_same(got: list[Rollout], wanted: list[Rollout]) -> None:
    for one, other in zip(got, wanted, strict=True):
        assert one.version == other.version and one.first_scene == other.first_scene
        for name, tensor in one.tensors().items():
            assert torch.equal(tensor, other.tensors()[name]), name


def run_timed(
    fleet: LocalFleet | RayFleet, versions: range = range(ROLLOUTS)
) -> tuple[list[Rollout], list[float]]:
    """Rollouts, and the seconds that each took."""
    got, took = [], []
    for version in versions:
        began = time.monotonic()
        got += run(fleet, range(version, version + 1))
        took.append(time.monotonic() - began)
    print("rollouts took", " ".join(f"{seconds:.2f}" for seconds in took), "s")
    return got, took


def until_whole(fleet: RayFleet, workers: int, version: int = ROLLOUTS) -> None:
    """Go on until all replacements have joined, as a training does."""
    began = time.monotonic()
    until = began + 60
    while fleet.alive() < workers:
        assert time.monotonic() < until, "the replacement must join"
        fleet.collect(weights(version), version, SIGMA)
        time.sleep(0.05)
    print(f"whole again after {time.monotonic() - began:.1f} s")


def gone(pids: list[int], within_s: float = 10.0) -> bool:
    until = time.monotonic() + within_s
    while any(Path(f"/proc/{pid}").exists() for pid in pids):
        if time.monotonic() > until:
            return False
        time.sleep(0.05)
    return True


@pytest.fixture(scope="module")
def undisturbed() -> list[Rollout]:
    fleet = local()
    rollouts = run(fleet)
    fleet.close()
    assert sum(len(r.end_index) for r in rollouts) > 50, "resets must be part of the comparison"
    return rollouts


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
    got, took = run_timed(fleet)
    assert_same(got, undisturbed)
    assert max(took) < RECOVERY_S, "the other one has collected its part"
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


def test_a_persons_mistake_is_told_at_once_and_as_itself():
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


def test_packed_and_back(undisturbed):
    assert_same([unpack_rollout(pack_rollout(r)) for r in undisturbed], undisturbed)


def test_nobody_listens():
    import ray

    ray.shutdown()
    began = time.monotonic()
    with (
        pytest.raises(ClusterError, match=r"no Ray answers at 127\.0\.0\.1:1 "),
        ray_session(cpus=1, address="127.0.0.1:1"),
    ):
        pass
    assert time.monotonic() - began < 10

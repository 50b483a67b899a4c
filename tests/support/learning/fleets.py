"""Ray fleets and local ones on the point shard, and the comparison of their rollouts."""

import time
from pathlib import Path

import torch

from actors.fleet import FleetConfig, RayFleet
from actors.local import LocalFleet
from policy.model.acting import publish
from policy.model.networks import Actor
from policy.model.normaliser import Normaliser
from policy.rollout import Rollout
from tests.support.faulty_shard import MakePoints
from tests.support.point_shard import ACTION, GOAL, STATE

SCENES, BLOCK, HORIZON, SIGMA = 48, 8, 8, 0.2
ROLLOUTS = 4
SOUND = MakePoints()
#: No rollout may be waited for until its deadline, which lies beyond the test's own.
QUICK = FleetConfig(start_s=60, rollout_s=600, restarts=1)


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


def until_whole(fleet: RayFleet, workers: int, version: int = ROLLOUTS) -> None:
    """Go on until all replacements have joined, as a training does."""
    until = time.monotonic() + 60
    while fleet.alive() < workers:
        assert time.monotonic() < until, "the replacement must join"
        fleet.collect(weights(version), version, SIGMA)
        time.sleep(0.05)


def gone(pids: list[int], within_s: float = 10.0) -> bool:
    until = time.monotonic() + within_s
    while any(Path(f"/proc/{pid}").exists() for pid in pids):
        if time.monotonic() > until:
            return False
        time.sleep(0.05)
    return True

"""Fleets on the point shard, and the comparison of their rollouts."""

import torch

from actors.local import LocalFleet
from policy.model.acting import publish
from policy.model.networks import Actor
from policy.model.normaliser import Normaliser
from policy.rollout import Rollout
from tests.support.point_shard import ACTION, GOAL, STATE, PointShard


def weights(gain: float = 3.0) -> dict[str, torch.Tensor]:
    torch.manual_seed(0)
    actor, normaliser = Actor(STATE + GOAL, ACTION, (16, 16)), Normaliser(STATE + GOAL)
    with torch.no_grad():
        actor.layers[-1].weight.mul_(gain / 0.01)
    return publish(actor, normaliser)


def fleet(workers: int, scenes: int = 48, block: int = 8, **shard) -> LocalFleet:
    return LocalFleet(
        lambda owned: PointShard(owned, 5, **shard), scenes, block, workers, seed=5, horizon=40
    )


def collect(workers: int, **shard) -> Rollout:
    held = fleet(workers, **shard)
    try:
        return held.collect(weights(), 3, 0.2)
    finally:
        held.close()


def assert_same(one: Rollout, other: Rollout) -> None:
    for name, tensor in one.tensors().items():
        assert torch.equal(tensor, other.tensors()[name]), name

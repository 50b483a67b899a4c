"""Learners of the point shard, their rollouts, and what two of them have in common."""

from dataclasses import replace

import torch

from actors.local import LocalFleet
from learner.config import LearnerConfig
from learner.ppo import Learner
from policy.rollout import Rollout
from tests.support.point_shard import ACTION, GOAL, STATE, PointShard
from world.precision import FLOAT32

CONFIG = LearnerConfig(
    hidden=(16, 16), warmup_iterations=0, minibatch=64, sigma=((0.0, 0.3),), gamma=0.9, lam=0.8
)


def bold(held: Learner) -> Learner:
    """With actions large enough that some points fall."""
    with torch.no_grad():
        held.actor.layers[-1].weight.mul_(200)
    return held


def learner(**changes) -> Learner:
    return Learner(STATE + GOAL, ACTION, replace(CONFIG, **changes), seed=3, precision=FLOAT32)


def collect(held: Learner, horizon: int = 16, **shard) -> Rollout:
    fleet = LocalFleet(
        lambda owned: PointShard(owned, 5, **shard), 16, 8, 2, seed=5, horizon=horizon
    )
    try:
        return fleet.collect(held.weights(), held.version, held.sigma)
    finally:
        fleet.close()


def same(one: dict, other: dict) -> bool:
    if one.keys() != other.keys():
        return False
    return all(
        same(v, other[k])
        if isinstance(v, dict)
        else torch.equal(v, other[k])
        if isinstance(v, torch.Tensor)
        else v == other[k]
        for k, v in one.items()
    )


def numbers(metrics: dict[str, float]) -> dict[str, float]:
    return {k: v for k, v in metrics.items() if not k.startswith("rate/")}

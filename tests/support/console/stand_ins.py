"""A part of a rollout, and processes that send it."""

import torch

from policy.model.acting import publish
from policy.model.networks import Actor
from policy.model.normaliser import Normaliser
from tests.support.point_shard import ACTION, GOAL, STATE

HIDDEN = (256, 256)


def weights(version: int) -> dict[str, torch.Tensor]:
    torch.manual_seed(version)
    return publish(Actor(STATE + GOAL, ACTION, HIDDEN), Normaliser(STATE + GOAL))

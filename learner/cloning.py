"""Behaviour cloning: an initial policy by regression on labelled actions."""

import torch
from torch import Tensor

from learner.optimiser import adam
from policy.model.networks import Actor
from policy.model.normaliser import Normaliser
from world.device import put


def clone(
    actor: Actor,
    normaliser: Normaliser,
    inputs: Tensor,
    targets: Tensor,
    passes: int = 8,
    rate: float = 1e-3,
    *,
    minibatch: int = 1024,
    seed: int = 0,
) -> list[float]:
    """Fit the normaliser to raw (state, goal) inputs [M, d], then the actor's mean to [M, 28].

    Returns the mean squared error of each pass. Train the critic alone for some iterations
    afterwards (`LearnerConfig.warmup_iterations`): the gradients of an untrained critic destroy a
    cloned actor.
    """
    normaliser.update(inputs)
    observations = normaliser(inputs)
    optimiser = adam(actor.parameters(), rate)
    generator = torch.Generator().manual_seed(seed)
    errors = []
    for _ in range(passes):
        total = 0.0
        order = put(torch.randperm(len(inputs), generator=generator), inputs.device)
        for rows in order.split(minibatch):
            loss = (actor(observations[rows]) - targets[rows]).square().mean()
            optimiser.zero_grad(set_to_none=True)
            loss.backward()
            optimiser.step()
            total += float(loss.detach()) * len(rows)
        errors.append(total / len(inputs))
    return errors

"""Losses and reward of the discriminator (Eq. 3-5 of Hassan et al. 2023), on logits."""

import math

import torch
from torch import Tensor
from torch.nn import functional

from discriminator.network import StyleNetwork


def classification(policy: Tensor, mocap: Tensor) -> Tensor:
    """Binary cross-entropy, half policy (label 0) and half mocap (label 1), of logits [n], [m]."""
    return 0.5 * functional.softplus(policy).mean() + 0.5 * functional.softplus(-mocap).mean()


def gradient_penalty(gradient: Tensor) -> Tensor:
    """Half the mean squared norm of d logit / d x, for rows [n, inputs]."""
    return 0.5 * gradient.square().sum(-1).mean()


def regularisation(network: StyleNetwork, logit: float, decay: float) -> Tensor:
    """`decay` x squared weights of all layers + `logit` x those of the output layer; no biases."""
    squares = [layer.weight.square().sum() for layer in network.linears]
    return decay * torch.stack(squares).sum() + logit * squares[-1]


def style_reward(logits: Tensor, clamp: float, scale: float) -> Tensor:
    """-log(max(1 - D, clamp)) x scale, D = sigmoid(logit): a softplus, clamped once."""
    return functional.softplus(logits).clamp(max=-math.log(clamp)) * scale

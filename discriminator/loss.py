"""Losses of the discriminator and the style reward (Hassan et al. 2023, Eq. 3-5), on logits."""

import math

import torch
from torch import Tensor
from torch.nn import functional

from discriminator.network import StyleNetwork


def classification(policy: Tensor, mocap: Tensor) -> Tensor:
    """Mean binary cross-entropy of policy (label 0) and mocap (label 1) logits; [n], [m] -> []."""
    return 0.5 * functional.softplus(policy).mean() + 0.5 * functional.softplus(-mocap).mean()


def gradient_penalty(gradient: Tensor) -> Tensor:
    """Half the mean squared norm of gradients d logit / d x; [n, inputs] -> []."""
    return 0.5 * gradient.square().sum(-1).mean()


def regularisation(network: StyleNetwork, logit: float, decay: float) -> Tensor:
    """`decay` × squared weights of all layers + `logit` × those of the output layer; no biases."""
    squares = [layer.weight.square().sum() for layer in network.linears]
    return decay * torch.stack(squares).sum() + logit * squares[-1]


def style_reward(logits: Tensor, clamp: float, scale: float) -> Tensor:
    """Style reward -log(max(1 - D, clamp)) × scale, D = sigmoid(logit); any shape."""
    return functional.softplus(logits).clamp(max=-math.log(clamp)) * scale

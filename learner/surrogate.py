"""Losses of PPO as pure functions of network outputs; sigma and clip are numbers or tensors []."""

from typing import cast

import torch
from torch import Tensor
from torch.nn import functional


def clipped_surrogate(log_ratio: Tensor, advantages: Tensor, clip: float | Tensor) -> Tensor:
    """Clipped surrogate loss -mean(min(r A, clip(r, 1 ± clip) A)); [n], [n] -> [].

    Schulman et al. 2017, Eq. 7.
    """
    ratio = log_ratio.exp()
    low, high = cast("float", 1.0 - clip), cast("float", 1.0 + clip)  # clamp takes tensors too
    bounded = ratio.clamp(low, high)
    return -torch.minimum(ratio * advantages, bounded * advantages).mean()


def soft_bound(means: Tensor) -> Tensor:
    """Squared excess of |mean action| over 1, summed over components: [n, a] -> []."""
    return (means.abs() - 1.0).clamp(min=0.0).square().sum(-1).mean()


def kl_fixed_sigma(means: Tensor, old_means: Tensor, sigma: float | Tensor) -> Tensor:
    """Mean KL of two Gaussians with one sigma, ½ |Δmean|² / sigma²: [n, a], [n, a] -> []."""
    return 0.5 * (means - old_means).square().sum(-1).mean() / sigma**2


def mirror_loss(means: Tensor, wanted: Tensor, gate: Tensor, sigma: float | Tensor) -> Tensor:
    """Mean over n of gate · Huber((means − wanted) / sigma), summed over components.

    [n, a], [n, a], [n] -> []. Linear beyond one sigma, so that outliers do not dominate.
    """
    apart = (means - wanted) / sigma
    huber = functional.huber_loss(apart, torch.zeros_like(apart), reduction="none")
    return (gate * huber.sum(-1)).mean()


def imitation_loss(means: Tensor, teacher_action: Tensor, sigma: float | Tensor) -> Tensor:
    """Mean over n of Huber((means − teacher_action) / sigma), summed over the components that are
    not NaN.

    [n, a], [n, a] -> []; linear beyond one sigma, as `mirror_loss`.
    """
    labelled = ~teacher_action.isnan()
    apart = torch.where(labelled, (means - teacher_action.nan_to_num()) / sigma, 0.0)
    return functional.huber_loss(apart, torch.zeros_like(apart), reduction="sum") / len(means)


def next_rate(rate: float, kl: float, target: float, bounds: tuple[float, float]) -> float:
    """Learning rate after an update: / 1.3 above twice the KL target, × 1.1 below half of it."""
    if kl > 2.0 * target:
        rate /= 1.3
    elif kl < 0.5 * target:
        rate *= 1.1
    return min(max(rate, bounds[0]), bounds[1])

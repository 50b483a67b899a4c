"""Advantages and returns of a batch of rollouts, as pure functions."""

import torch
from torch import Tensor


def mixed_reward(
    task: Tensor, style: Tensor | None, task_weight: float, style_weight: float
) -> Tensor:
    """r = w_task r_task + w_style r_style, [T, N]; without style the task's part alone."""
    mixed = task_weight * task
    return mixed if style is None else mixed + style_weight * style


def advantages(
    rewards: Tensor,
    values: Tensor,
    next_values: Tensor,
    fell: Tensor,
    timed_out: Tensor,
    valid: Tensor,
    gamma: float,
    lam: float,
) -> Tensor:
    """Generalised advantage estimates [T, N] (Schulman et al. 2016, Eq. 16).

    `values` [T, N] are of the states acted from, `next_values` [T, N] of their true successors
    (for an episode that ended, of its last state, not of the next episode's first). A fall is worth
    0 after it; a time-out keeps the value of its last state; the sum is cut after both. Samples
    that are not `valid` get 0 and pass nothing on, whatever their reward (it may be NaN): what came
    before them bootstraps with the value of the last finite state.
    """
    after = torch.where(fell, torch.zeros_like(next_values), next_values)
    errors = torch.where(valid, rewards + gamma * after - values, torch.zeros_like(rewards))
    keep = torch.where(fell | timed_out | ~valid, 0.0, gamma * lam)
    found = torch.empty_like(rewards)
    running = torch.zeros_like(rewards[0])
    for t in reversed(range(rewards.shape[0])):
        running = errors[t] + keep[t] * running
        found[t] = running
    return found


def explained_variance(predicted: Tensor, target: Tensor) -> float:
    """1 - Var(target - predicted) / Var(target); 0 where the target does not vary."""
    spread = target.double().var(correction=0)
    if spread <= 1e-12:
        return 0.0
    residual = (target.double() - predicted.double()).var(correction=0)
    return float(1.0 - residual / spread)

"""Mixed rewards, advantages and explained variance as pure functions."""

import torch
from torch import Tensor


def mixed_reward(
    task: Tensor,
    style: Tensor | None,
    task_weight: float,
    style_weight: float,
    styled: Tensor | None = None,
) -> Tensor:
    """Mixed reward w_task r_task + w_style r_style, [T, N]; without style only the first term.

    styled: [N] bool: scenes with this reward; others have r_task alone, of weight 1. None: all.
    """
    mixed = task_weight * task
    mixed = mixed if style is None else mixed + style_weight * style
    return mixed if styled is None else torch.where(styled.to(task.device), mixed, task)


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

    values: [T, N] of the states acted from. next_values: [T, N] of their true successors (at the
    end of an episode its last state, not the next episode's first). A fall is a terminal state and
    is not bootstrapped; a time-out is truncated and bootstraps with the value of its last state;
    the sum ends at both. A sample that is not `valid` gets 0, also where its reward is NaN; the
    samples before it bootstrap with the value of the last finite state.
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

"""Transitions (s, s') of a rollout from its states, which are stored once."""

import torch
from torch import Tensor

from discriminator.errors import StyleError


def next_states(states: Tensor, end_index: Tensor, end_states: Tensor) -> Tensor:
    """True successors [T, N, F] of `states[:-1]`.

    states: [T+1, N, F]; where an episode ended, states[t+1] is the next episode's first.
    end_index: [K, 2] int64 (t, n) of the steps that ended an episode.
    end_states: [K, F], the last state of those episodes.
    """
    successors = states[1:].clone()
    if len(end_index):
        successors[end_index[:, 0], end_index[:, 1]] = end_states
    return successors


def check_rollout(
    states: Tensor, end_index: Tensor, end_states: Tensor, valid: Tensor, width: int
) -> None:
    """Raise StyleError, naming the field and its valid form, if a rollout's arrays do not fit."""
    if states.ndim != 3 or states.shape[0] < 2 or states.shape[2] != width:
        raise StyleError(
            f"states: shape {list(states.shape)}, must be [T+1, N, {width}] with T >= 1"
        )
    steps, scenes = states.shape[0] - 1, states.shape[1]
    if end_index.ndim != 2 or end_index.shape[1] != 2 or end_index.dtype != torch.int64:
        raise StyleError(f"end_index: {_form(end_index)}, must be int64 [K, 2] (step, scene)")
    if tuple(end_states.shape) != (len(end_index), width):
        raise StyleError(
            f"end_states: shape {list(end_states.shape)}, must be [{len(end_index)}, {width}]"
        )
    if valid.dtype != torch.bool or tuple(valid.shape) != (steps, scenes):
        raise StyleError(f"valid: {_form(valid)}, must be bool [{steps}, {scenes}]")
    if len(end_index):
        low, high = end_index.amin(0), end_index.amax(0)
        if low.min() < 0 or high[0] >= steps or high[1] >= scenes:
            raise StyleError(
                f"end_index: values out of range, steps must be 0..{steps - 1} "
                f"and scenes 0..{scenes - 1}"
            )


def _form(tensor: Tensor) -> str:
    return f"{str(tensor.dtype).removeprefix('torch.')} {list(tensor.shape)}"

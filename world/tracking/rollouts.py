"""Simulated states of trackings that went well, as initial states of tracking.

A reference state is a recorded posture on our character: feet may be in the floor or above it, and
its velocities need not be those that our masses can have. A state of a rollout that came by that
frame, and went on, is physical. (Physical state initialisation of InterMimic, arXiv:2502.20390,
after the reference state initialisation of DeepMimic.)
"""

from dataclasses import dataclass

import torch
from torch import Tensor

#: At most so many states of a frame and box are kept.
_EACH = 2
#: Fraction of the starts in frames with such states that are replaced. (No frame was found whose
#: reference states alone fail: of a tracker's failures 7-17 % are within a second of the start.)
_SHARE = 0.5


@dataclass(frozen=True)
class Rollouts:
    """A states in the clips' worlds, ordered by their keys."""

    key: Tensor
    """[A] int64, ascending: frame · boxes + box; see `keys`."""
    qpos: Tensor
    """[A, 43]."""
    qvel: Tensor
    """[A, 34]."""
    box: Tensor
    """[A, 7]: pose of the box; without meaning where the clip has none."""
    box_velocity: Tensor
    """[A, 6]."""

    def replaced(self, key: Tensor, u: Tensor) -> tuple[Tensor, Tensor]:
        """Return the starts to be replaced [k], of m with keys [m], and the numbers [k] of their
        states, by u [m, 2] in [0, 1)."""
        low = torch.searchsorted(self.key, key)
        count = torch.searchsorted(self.key, key, right=True) - low
        rows = torch.nonzero((count > 0) & (u[:, 0] < _SHARE)).flatten()
        number = low + (u[:, 1] * count).long().clamp_max((count - 1).clamp_min(0))
        return rows, number[rows]


def keys(frame: Tensor, variant: Tensor, each: int) -> Tensor:
    """Return the keys [m] of frames [m] with the boxes of variants [m], of which a clip has
    `each`."""
    return frame * each + variant % each


def kept(key: Tensor, random: torch.Generator) -> Tensor:
    """Return the indices [k] of states with keys [m] to keep, by key: some of each, drawn by
    `random`."""
    shuffled = torch.randperm(len(key), generator=random)
    order = shuffled[torch.argsort(key[shuffled], stable=True)]
    ordered = key[order]
    rank = torch.arange(len(key)) - torch.searchsorted(ordered, ordered)
    return order[rank < _EACH]

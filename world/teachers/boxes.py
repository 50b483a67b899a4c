"""The boxes of a bank, and how they are turned in the hands: what teachers of carry share."""

from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from world import rotations

QUARTER = 0.5 * np.pi
#: Ratio of neighbouring sizes of box that have variants of their own.
_RATIO = 1.12


class Boxes(Protocol):
    """The boxes of a bank of scenes."""

    half: Tensor
    """[V, 3]: half edges, m."""
    mass: Tensor
    """[V]: kg."""


def half_turned(half: Tensor, turns: Tensor) -> Tensor:
    """Half edges [n, 3] along axes that are turned by quarter turns [n]."""
    return torch.where((turns % 2 == 0)[:, None], half, half[:, [1, 0, 2]])


def quarter_turns(heading: Tensor, rotation: Tensor) -> Tensor:
    """[n] int64: quarter turns of the axes of boxes with rotations [n, 4], after which their x
    axis is nearest to the headings [n, 2]."""
    off = rotations.yaw(rotations.heading(rotation)) - rotations.yaw(heading)
    return (-torch.round(off / QUARTER)).long() % 4


def sizes(bank: Boxes) -> list[np.ndarray]:
    """Edges [3] of boxes, m, of which one is like each of the bank's, held by either pair of
    faces."""
    edges = 2.0 * bank.half.double().numpy()
    order = np.argsort(edges[:, 1])
    chosen: list[np.ndarray] = []
    for one in edges[order]:
        if not chosen or one[1] > _RATIO * chosen[-1][1]:
            chosen.append(one)
    return [found for one in chosen for found in (one, one[[1, 0, 2]])]

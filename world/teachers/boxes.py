"""The boxes of a bank, and how they are turned in the hands: what teachers of carry share."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from world import rotations
from world.motions.clip import Clip
from world.motions.objects import BoxTrack

QUARTER = 0.5 * np.pi
#: Ratio of neighbouring sizes of box that have variants of their own.
_RATIO = 1.12
#: Costs of a metre of width between the hands, and of depth, in a fit.
_WIDTH_COST, _DEPTH_COST = 10.0, 3.0


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


def misfit(half: Tensor, known: Tensor) -> Tensor:
    """[n, V]: how badly boxes of half edges known [V, 3], m, stand for those of half [n, 3]; y is
    along the line between the hands."""
    off = (half[:, None] - known).abs()
    return _WIDTH_COST * off[..., 1] + _DEPTH_COST * off[..., 0]


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


def originals(clips: Sequence[Clip]) -> list[Clip]:
    """Return the clips with a held box; of a clip and its variants, which are named by it, the one
    whose box rests lowest: all others can be made of it."""
    lowest: dict[tuple[str, bool], Clip] = {}
    for clip in clips:
        if clip.box is None or not clip.box.held.any():
            continue
        key = clip.name.partition("~")[0], clip.name.endswith("~mirrored")
        known = lowest.get(key)
        if known is None or known.box is None or _rest_m(clip.box) < _rest_m(known.box):
            lowest[key] = clip
    return list(lowest.values())


def _rest_m(box: BoxTrack) -> float:
    """Least height of a box's underside, m."""
    return float(box.pose[:, 2].min()) - 0.5 * box.size_m[2]

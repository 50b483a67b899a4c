"""Features of short windows of motion, by which sets of motions are compared.

The features are fixed, not learned: positions and accelerations of the bodies. So a comparison
means the same for every policy, and can be repeated.
"""

from collections.abc import Sequence

import torch
from torch import Tensor

from world import rotations
from world.character import model as character
from world.realism.measures import Motion, positions

#: Frames of a window: 0.5 s. Windows of a motion begin this many frames apart.
LENGTH, STRIDE = 16, 5
#: Frames of a window whose positions, and whose accelerations, are features.
SAMPLED, ACCELERATED = (0, 5, 10, 15), (3, 8, 12)
_EACH = len(character.BODIES) * 3
#: Number of features.
FEATURES = (len(SAMPLED) + len(ACCELERATED)) * _EACH
#: Smallest differences [FEATURES] that matter: 5 mm, and 0.5 m/s².
LEAST = torch.cat(
    (torch.full((len(SAMPLED) * _EACH,), 0.005), torch.full((len(ACCELERATED) * _EACH,), 0.5))
)


def windows(motion: Motion) -> Tensor:
    """Return the features [W, FEATURES] of a motion's windows, float32.

    Each row holds the bodies' positions in SAMPLED frames, m, and accelerations in ACCELERATED
    frames, m/s² (second differences), in the heading frame of the root in the window's first frame,
    whose origin is on the floor below the root. W is 0 for a motion that is shorter than LENGTH.
    """
    frames = len(motion.qpos)
    if frames < LENGTH:
        return torch.zeros(0, FEATURES)
    position = positions(motion.qpos)
    first = torch.arange(0, frames - LENGTH + 1, STRIDE)
    heading = rotations.heading(motion.qpos[first, 3:7].double())
    origin = position[first, 0] * torch.tensor((1.0, 1.0, 0.0), dtype=position.dtype)
    rows = [position[first + k] - origin[:, None] for k in SAMPLED]
    rows += [
        (position[first + k + 1] - 2.0 * position[first + k] + position[first + k - 1])
        * character.CONTROL_HZ**2
        for k in ACCELERATED
    ]
    rows = [rotations.turn_back(heading[:, None], row) for row in rows]
    return torch.stack(rows, dim=1).flatten(1).float()


def of_all(motions: Sequence[Motion]) -> tuple[Tensor, Tensor]:
    """Return the windows [W, FEATURES] of several motions, and the index [W] of each one's
    motion."""
    parts = [windows(motion) for motion in motions]
    index = [torch.full((len(part),), i) for i, part in enumerate(parts)]
    if not parts:
        return torch.zeros(0, FEATURES), torch.zeros(0, dtype=torch.int64)
    return torch.cat(parts), torch.cat(index)

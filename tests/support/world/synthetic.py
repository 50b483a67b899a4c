"""The synthetic clips as poses of the simulator's bodies."""

from dataclasses import dataclass

import numpy as np

from world.motions.clip import Clip
from world.motions.synthetic import rotations, skeleton


@dataclass(frozen=True)
class Posed:
    """A clip with its bodies' positions and rotations in the world, and its local rotations."""

    clip: Clip
    positions: np.ndarray
    world: np.ndarray
    local: np.ndarray


def posed(clip: Clip) -> Posed:
    local = rotations.matrix(clip.local_rotation.astype(np.float64))
    return Posed(clip, *skeleton.forward(clip.root_position_m.astype(np.float64), local), local)


def standing(clip: Clip) -> np.ndarray:
    """[T] bool: the pelvis is at the height of one who stands, walks or bends a little."""
    return clip.root_position_m[:, 2] > 0.75

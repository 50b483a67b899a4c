"""Clips of carrying and lying whose object is known."""

from dataclasses import replace

import numpy as np
import torch

from world import rotations
from world.motions.clip import Clip
from world.motions.synthetic.carries import carrying


def a_carry(
    seed: int = 0, width_m: float = 0.4, heights_m: tuple[float, float] = (0.4, 0.7)
) -> Clip:
    size = (0.3, width_m, 0.25)
    return carrying(np.random.default_rng(seed), size, heights_m, 2.0, 1.2)


def shaken(clip: Clip, position_m: float, angle_rad: float) -> Clip:
    """The clip as a camera system has it: smooth errors of a position and of every joint."""
    noise = np.random.default_rng(1)

    def drift(*shape: int) -> np.ndarray:
        knots = noise.standard_normal((clip.frames // 10 + 2, *shape))
        at = np.arange(clip.frames) / 10
        low = at.astype(int)
        share = (at - low).reshape(-1, *([1] * len(shape)))
        return knots[low] * (1 - share) + knots[low + 1] * share

    half = 0.5 * angle_rad * drift(15, 3)
    turn = np.concatenate((np.ones((clip.frames, 15, 1)), half), axis=-1)
    turn /= np.linalg.norm(turn, axis=-1, keepdims=True)
    local = rotations.multiply(torch.from_numpy(clip.local_rotation), torch.from_numpy(turn))
    moved = clip.root_position_m + position_m * drift(3)
    return replace(
        clip,
        root_position_m=moved.astype(np.float32),
        local_rotation=local.numpy().astype(np.float32),
    )


def angle_deg(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Angle between quaternions [T, 4], degrees."""
    return np.degrees(2 * np.arccos(np.clip(np.abs(np.sum(first * second, -1)), 0, 1)))

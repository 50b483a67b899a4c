"""Body poses of a clip, heights of its lowest points, and helpers of the fitting."""

import numpy as np
import torch
from torch import Tensor

from world import rotations
from world.character import kinematics, soles
from world.character import model as character
from world.motions.clip import Clip

#: Lowest points of the character: per body, spheres (centre, radius) of its capsules' ends and
#: spheres.
_SITTING_SPHERES = {
    "pelvis": (((0.0, 0.0, 0.07), 0.09),),
    "right_thigh": (((0.0, 0.0, -0.06), 0.055),),
    "left_thigh": (((0.0, 0.0, -0.06), 0.055),),
}


def body_poses(clip: Clip) -> tuple[Tensor, Tensor]:
    """World positions [T, 15, 3] m and rotation matrices [T, 15, 3, 3] of the clip's bodies."""
    local = rotations.matrix(torch.from_numpy(clip.local_rotation))
    return kinematics.forward(torch.from_numpy(clip.root_position_m), local)


def sole_heights(position: Tensor, rotation: Tensor) -> np.ndarray:
    """Height of the lowest corner of the right and the left sole, m: [T, 2]."""
    corners = soles.corners(position[:, soles.FEET], rotation[:, soles.FEET])
    lowest: np.ndarray = corners[..., 2].amin(dim=2).numpy()
    return lowest


def seat_clearance(position: Tensor, rotation: Tensor) -> np.ndarray:
    """Height [T] of the lowest point of pelvis and upper thighs, which rest on a seat, m."""
    lowest = []
    for name, spheres in _SITTING_SPHERES.items():
        body = character.BODIES.index(name)
        for centre, radius in spheres:
            offset = rotation[:, body, 2] @ torch.tensor(centre, dtype=position.dtype)
            lowest.append(position[:, body, 2] + offset - radius)
    return torch.stack(lowest, dim=1).min(dim=1).values.numpy()


def smooth(x: np.ndarray, sigma: float) -> np.ndarray:
    """Gaussian smoothing along time with mirrored ends; sigma in frames."""
    half = int(np.ceil(3 * sigma))
    kernel = np.exp(-0.5 * (np.arange(-half, half + 1) / sigma) ** 2)
    return np.convolve(
        np.pad(x, half, mode="reflect", reflect_type="odd"), kernel / kernel.sum(), mode="valid"
    )


def stretches(mask: np.ndarray) -> list[tuple[int, int]]:
    """(first, one beyond last) of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]

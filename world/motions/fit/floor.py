"""Resampling of raw clips to 30 Hz, and correction of their floor height."""

from dataclasses import replace

import numpy as np

from world.character import model as character
from world.motions.clip import Clip, continuous
from world.motions.fit.poses import body_poses, smooth, sole_heights


def resampled(clip: Clip, fps: int = character.CONTROL_HZ) -> Clip:
    """The clip at `fps`: positions linear in time, rotations along the shorter arc."""
    if clip.fps == fps:
        return clip
    frames = max(2, int(np.floor((clip.frames - 1) * fps / clip.fps)) + 1)
    at = np.minimum(np.arange(frames) * clip.fps / fps, clip.frames - 1)
    low = np.minimum(at.astype(int), clip.frames - 2)
    fraction = (at - low).astype(np.float64)
    position = clip.root_position_m.astype(np.float64)
    position = position[low] + fraction[:, None] * (position[low + 1] - position[low])
    rotation = np.stack([continuous(clip.local_rotation[:, b]) for b in range(15)], axis=1)
    # adjacent frames differ by a few degrees: the normalised chord is the arc to 1e-5
    rotation = rotation[low] + fraction[:, None, None] * (rotation[low + 1] - rotation[low])
    rotation /= np.linalg.norm(rotation, axis=-1, keepdims=True)
    ghost = clip.ghost
    if ghost is not None:
        joints = ghost.position_m
        joints = joints[low] + fraction[:, None, None] * (joints[low + 1] - joints[low])
        ghost = replace(ghost, position_m=joints.astype(np.float32))
    return replace(
        clip,
        fps=fps,
        root_position_m=position.astype(np.float32),
        local_rotation=rotation.astype(np.float32),
        ghost=ghost,
    )


def _rolling_min(x: np.ndarray, half: int) -> np.ndarray:
    padded = np.pad(x, half, mode="edge")
    return np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1).min(axis=1)


def floor_corrected(clip: Clip) -> Clip:
    """The clip shifted so that its supporting foot is at z = 0: clips drift by up to 8 cm in
    height.

    The shift follows the lowest sole, smoothed over about 0.2 s; where both feet are in the air
    (seated with raised feet, in flight) it is the clip's own level. A retargeted clip is on its
    floor already and is unchanged.
    """
    if clip.ghost is not None:
        return clip
    position, rotation = body_poses(clip)
    lowest = sole_heights(position, rotation).min(axis=1).astype(np.float64)
    window = max(1, round(0.1 * clip.fps))
    lowest = _rolling_min(lowest, window)
    level = float(np.median(lowest[lowest < np.percentile(lowest, 60) + 1e-9]))
    lowest = np.clip(lowest, level - 0.05, level + 0.03)
    if clip.frames > 8 * window:
        lowest = smooth(lowest, 0.15 * clip.fps)
    moved = clip.root_position_m.copy()
    moved[:, 2] -= lowest.astype(np.float32)
    ghost = clip.ghost
    if ghost is not None:
        joints = ghost.position_m.copy()
        joints[..., 2] -= lowest.astype(np.float32)[:, None]
        ghost = replace(ghost, position_m=joints)
    return replace(clip, root_position_m=moved, ghost=ghost)

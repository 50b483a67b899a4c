"""Augmentation of clips: other playback speeds."""

from dataclasses import replace
from typing import TypeVar

import numpy as np

from world.errors import ConfigError
from world.motions.clip import Clip, continuous_bodies
from world.motions.objects import Bed, BoxTrack, Seat

#: Least and greatest playback speed: people walk, sit and lift the same way in this range.
SPEEDS = (0.8, 1.25)

SeatOrBed = TypeVar("SeatOrBed", Seat, Bed)


def at_speed(clip: Clip, speed: float) -> Clip:
    """The clip at a playback speed, at its own frame rate, with its objects.

    Poses are unchanged, velocities are multiplied by `speed`. Raises ConfigError outside SPEEDS.
    """
    low, high = SPEEDS
    if not low <= speed <= high:
        raise ConfigError(f"playback speed {speed:g}: choose {low} to {high}")
    frames = max(2, int(np.floor((clip.frames - 1) / speed)) + 1)
    at = np.minimum(np.arange(frames) * speed, clip.frames - 1)
    return replace(
        _at(clip, at),
        name=f"{clip.name}~x{speed:g}",
        seat=_seat_or_bed(clip.seat, speed, frames) if clip.seat else None,
        bed=_seat_or_bed(clip.bed, speed, frames) if clip.bed else None,
        box=_box(clip.box, at) if clip.box else None,
    )


def _at(clip: Clip, at: np.ndarray) -> Clip:
    """The clip at fractional frames [n], interpolated."""
    low = np.minimum(at.astype(int), clip.frames - 2)
    fraction = (at - low).astype(np.float32)[:, None, None]

    def between(values: np.ndarray) -> np.ndarray:
        return (values[low] * (1 - fraction) + values[low + 1] * fraction).astype(np.float32)

    rotation = continuous_bodies(clip.local_rotation)
    # adjacent frames differ by a few degrees: the normalised chord is the arc to 1e-5
    rotation = between(rotation)
    ghost = clip.ghost
    return replace(
        clip,
        root_position_m=between(clip.root_position_m[:, None])[:, 0],
        local_rotation=rotation / np.linalg.norm(rotation, axis=-1, keepdims=True),
        ghost=replace(ghost, position_m=between(ghost.position_m)) if ghost else None,
    )


def _seat_or_bed(thing: SeatOrBed, speed: float, frames: int) -> SeatOrBed:
    first = min(round(thing.from_frame / speed), frames - 1)
    last = min(max(round(thing.to_frame / speed), first + 1), frames)
    return replace(thing, from_frame=first, to_frame=last)


def _box(box: BoxTrack, at: np.ndarray) -> BoxTrack:
    low = np.minimum(at.astype(int), len(box.pose) - 2)
    fraction = (at - low)[:, None]
    here, there = box.pose[low], box.pose[low + 1]
    sign = np.where((here[:, 3:] * there[:, 3:]).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    there = np.concatenate((there[:, :3], sign * there[:, 3:]), axis=1)
    pose = here * (1 - fraction) + there * fraction
    pose[:, 3:] /= np.linalg.norm(pose[:, 3:], axis=1, keepdims=True)
    nearest = np.minimum(np.rint(at).astype(int), len(box.held) - 1)
    return replace(box, pose=pose.astype(np.float32), held=box.held[nearest])

"""Stages of a clip, found without labels, and its frames that are unfit for training.

Contact is the stretch of use that the fitting found. In the transition about it the body leaves its
upright height, turns and slows down beside the object, or bends to the box.
"""

from functools import cache

import numpy as np
import torch
from torch import Tensor

from world.character import model as character
from world.motions.clip import Clip
from world.motions.fit.poses import body_poses, smooth, sole_heights, stretches
from world.objects import clearance

APPROACH, TRANSITION, CONTACT, LEAVE = 0, 1, 2, 3
NAMES = ("approach", "transition", "contact", "leave")

#: A pelvis above this fraction of its standing height is upright.
_UPRIGHT = 0.95
#: Beside the object: this near to the use point, m, for at most this long, s.
_BESIDE_M, _BESIDE_S = 0.75, 1.5
#: Hands this near to a resting box reach for it or have just let go, m.
_REACH_M = 0.45
#: A box is lifted from this fraction of its way up on.
_LIFTED = 0.9

#: Limbs deeper than this in another limb or the trunk, m; neighbouring bodies always overlap.
_OVERLAP_M = 0.06
#: A flat sole on the floor that is faster than this for this long slides, m/s, s.
_SLIDE_M_S, _SLIDE_S = 0.5, 0.1
_FLAT_M = 0.015
#: Accelerations beyond these are breaks, m/s² and rad/s²: people reach a third.
_BREAK_M_S2, _BREAK_RAD_S2 = 120.0, 900.0
#: Frames before and after an unfit one that are unfit too.
_MARGIN = 2


def stages(clip: Clip) -> np.ndarray:
    """APPROACH, TRANSITION, CONTACT or LEAVE of each frame: [T] int64; APPROACH throughout without
    an object."""
    stage = np.full(clip.frames, APPROACH, np.int64)
    if clip.box is not None and clip.box.held.any():
        contact, transition = _of_box(clip)
    elif clip.seat is not None:
        contact, transition = _of_place(
            clip, clip.seat.point_m, clip.seat.from_frame, clip.seat.to_frame
        )
    elif clip.bed is not None:
        contact, transition = _of_place(
            clip, clip.bed.hip_m, clip.bed.from_frame, clip.bed.to_frame
        )
    else:
        return stage
    used = np.flatnonzero(contact | transition)
    stage[used[-1] + 1 :] = LEAVE
    stage[transition] = TRANSITION
    stage[contact] = CONTACT
    return stage


def _of_place(
    clip: Clip, point_m: tuple[float, float, float], start: int, stop: int
) -> tuple[np.ndarray, np.ndarray]:
    """Contact [T] bool with a seat or bed, and transition [T] bool to and from it."""
    frames = np.arange(clip.frames)
    contact = (frames >= start) & (frames < stop)
    height = clip.root_position_m[:, 2]
    down = height < _UPRIGHT * np.percentile(height, 95)
    first, last = start, stop
    while first > 0 and down[first - 1]:
        first -= 1
    while last < clip.frames and down[last]:
        last += 1
    away = np.linalg.norm(clip.root_position_m[:, :2] - np.array(point_m[:2]), axis=1)
    # the end of the approach: within _BESIDE_M for the last time before the descent
    limit = round(_BESIDE_S * clip.fps)
    begin, end = first, last
    while begin > max(0, first - limit) and away[begin - 1] < _BESIDE_M:
        begin -= 1
    while end < min(clip.frames, last + limit) and away[end] < _BESIDE_M:
        end += 1
    return contact, (frames >= begin) & (frames < end) & ~contact


def _of_box(clip: Clip) -> tuple[np.ndarray, np.ndarray]:
    """Contact [T] bool, which is carrying, and transition [T] bool: reaching for the box, lifting,
    lowering, letting go."""
    box = clip.box
    assert box is not None
    position, _ = body_poses(clip)
    hands = position[:, [5, 8]].numpy()
    middle = hands.mean(axis=1)
    near = np.linalg.norm(middle - box.pose[:, :3], axis=1) < _REACH_M
    transition = np.zeros(clip.frames, bool)
    contact = np.zeros(clip.frames, bool)
    for start, stop in stretches(box.held):
        height = box.pose[start:stop, 2]
        carried = float(np.median(height))
        first, last = start, stop
        if start > 0:
            first += _passed(height, carried)
        if stop < clip.frames:
            last -= _passed(height[::-1], carried)
        first, last = (first, last) if first < last else (start, stop)
        contact[first:last] = True
        transition[start:first] = transition[last:stop] = True
        while start > 0 and near[start - 1]:
            start -= 1
            transition[start] = True
        while stop < clip.frames and near[stop]:
            transition[stop] = True
            stop += 1
    return contact, transition & ~contact


def _passed(height: np.ndarray, carried_m: float) -> int:
    """Number of frames from the first height of a box to (nearly) the carried one."""
    there = np.abs(height - carried_m) <= (1 - _LIFTED) * abs(float(height[0]) - carried_m) + 0.01
    return int(np.argmax(there)) if there.any() else 0


def usable(clip: Clip) -> np.ndarray:
    """[T] bool: False where limbs overlap, a sole slides, or velocities jump."""
    bad = overlapping(clip) | sliding(clip) | broken(clip)
    padded = np.pad(bad, _MARGIN)
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * _MARGIN + 1)
    return np.logical_not(windows.any(axis=1))


def overlapping(clip: Clip) -> np.ndarray:
    """[T] bool: a limb penetrates another one or the trunk by more than 6 cm."""
    centres = clearance.points(torch.from_numpy(clip.qpos()))
    first, second = _pairs()
    touch = clearance.RADII[first] + clearance.RADII[second]
    apart = (centres[:, first] - centres[:, second]).norm(dim=-1)
    return (apart < touch - _OVERLAP_M).any(dim=1).numpy()


@cache
def _pairs() -> tuple[Tensor, Tensor]:
    """Pairs of spheres that should not overlap: of bodies that no joint connects."""
    bodies = clearance.BODIES.tolist()
    first, second = torch.triu_indices(len(bodies), len(bodies), 1)
    apart = torch.tensor(
        [
            _joints_between(bodies[i], bodies[j]) > 1
            for i, j in zip(first.tolist(), second.tolist(), strict=True)
        ]
    )
    return first[apart], second[apart]


def _joints_between(first: int, second: int) -> int:
    """Number of joints between two bodies."""

    def to_root(body: int) -> list[int]:
        way = [body]
        while way[-1] != 0:
            way.append(character.PARENTS[way[-1]])
        return way

    one, other = to_root(first), to_root(second)
    shared = len(set(one) & set(other))
    return len(one) + len(other) - 2 * shared


def sliding(clip: Clip) -> np.ndarray:
    """[T] bool: a sole is flat on the floor and slides."""
    position, rotation = body_poses(clip)
    low = sole_heights(position, rotation) < _FLAT_M
    up = rotation[:, [11, 14], 2, 2].numpy() > np.cos(np.deg2rad(10.0))
    feet = position[:, [11, 14], :2].numpy().astype(np.float64)
    bad = np.zeros(clip.frames, bool)
    for side in (0, 1):
        path = np.stack([smooth(x, 1.0) for x in feet[:, side].T], axis=1)
        velocity = np.gradient(path, axis=0) * clip.fps
        speed = np.hypot(velocity[:, 0], velocity[:, 1])
        slides = low[:, side] & up[:, side] & (speed > _SLIDE_M_S)
        for start, stop in stretches(slides):
            bad[start:stop] |= stop - start >= _SLIDE_S * clip.fps
    return bad


def broken(clip: Clip) -> np.ndarray:
    """[T] bool: velocities jump by more than a human body's can."""
    jump = np.abs(np.diff(clip.qvel().astype(np.float64), axis=0)) * clip.fps
    breaks = (jump[:, :3] > _BREAK_M_S2).any(axis=1) | (jump[:, 3:] > _BREAK_RAD_S2).any(axis=1)
    return np.concatenate((breaks, [False])) | np.concatenate(([False], breaks))

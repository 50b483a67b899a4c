"""What a raw clip lacks: 30 Hz, a floor under its feet, and the objects that it used.

Furniture and boxes were not recorded with the clips: the seat is where the pelvis rests (method.md,
motions), the bed where the trunk does, the box goes with the hands.
"""

import itertools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from world import rotations
from world.character import kinematics
from world.character import model as character
from world.errors import ChoiceError
from world.motions.clip import Clip, continuous
from world.motions.objects import Bed, Seat

#: Lowest points of the character: per body, spheres (centre, radius) of its capsules' ends and
#: spheres.
_SITTING_SPHERES = {
    "pelvis": (((0.0, 0.0, 0.07), 0.09),),
    "right_thigh": (((0.0, 0.0, -0.06), 0.055),),
    "left_thigh": (((0.0, 0.0, -0.06), 0.055),),
}
_SOLE = tuple((x, y, -0.05) for x in (-0.0435, 0.1335) for y in (-0.045, 0.045))

#: Pelvis height below which a character is down on something, m (standing: 0.85; seated:
#: 0.45-0.55).
_DOWN_M = 0.64
#: Trunk further than this from vertical and pelvis lower than this: lying, not sitting.
_LYING_TILT = np.cos(np.deg2rad(60.0))
_LYING_PELVIS_M = 0.43
#: What one rests on below this is a low bed or the floor, m.
_LOWEST_SEAT_M = 0.25
_REST_SPEED_M_S = 0.10
_REST_MIN_S = 0.8


def resampled(clip: Clip, fps: int = character.CONTROL_HZ) -> Clip:
    """The clip at `fps`: positions linear in time, rotations along the shorter arc."""
    if clip.fps == fps:
        return clip
    frames = max(2, int(np.floor((clip.frames - 1) * fps / clip.fps)) + 1)
    at = np.minimum(np.arange(frames) * clip.fps / fps, clip.frames - 1)
    low = np.minimum(at.astype(int), clip.frames - 2)
    share = (at - low).astype(np.float64)
    position = clip.root_position_m.astype(np.float64)
    position = position[low] + share[:, None] * (position[low + 1] - position[low])
    rotation = np.stack([continuous(clip.local_rotation[:, b]) for b in range(15)], axis=1)
    # neighbouring frames are a few degrees apart: the normalised chord is the arc to 1e-5
    rotation = rotation[low] + share[:, None, None] * (rotation[low + 1] - rotation[low])
    rotation /= np.linalg.norm(rotation, axis=-1, keepdims=True)
    ghost = clip.ghost
    if ghost is not None:
        joints = ghost.position_m
        joints = joints[low] + share[:, None, None] * (joints[low + 1] - joints[low])
        ghost = replace(ghost, position_m=joints.astype(np.float32))
    return replace(
        clip,
        fps=fps,
        root_position_m=position.astype(np.float32),
        local_rotation=rotation.astype(np.float32),
        ghost=ghost,
    )


def body_poses(clip: Clip) -> tuple[Tensor, Tensor]:
    """World positions [T, 15, 3] m and rotation matrices [T, 15, 3, 3] of the clip's bodies."""
    local = rotations.matrix(torch.from_numpy(clip.local_rotation))
    return kinematics.forward(torch.from_numpy(clip.root_position_m), local)


def sole_heights(position: Tensor, rotation: Tensor) -> np.ndarray:
    """Height of the lowest corner of the right and the left sole, m: [T, 2]."""
    heights = []
    for foot in ("right_foot", "left_foot"):
        body = character.BODIES.index(foot)
        corners = torch.tensor(_SOLE, dtype=position.dtype)
        offsets = corners @ rotation[:, body, 2, :, None]
        heights.append((position[:, body, 2, None] + offsets[..., 0]).min(dim=1).values)
    return torch.stack(heights, dim=1).numpy()


def seat_clearance(position: Tensor, rotation: Tensor) -> np.ndarray:
    """Height of the lowest point of pelvis and upper thighs, m: [T]; what rests on the seat."""
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
    return np.convolve(np.pad(x, half, mode="reflect"), kernel / kernel.sum(), mode="valid")


def _rolling_min(x: np.ndarray, half: int) -> np.ndarray:
    padded = np.pad(x, half, mode="edge")
    return np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1).min(axis=1)


def floor_mended(clip: Clip) -> Clip:
    """The clip moved so that its supporting foot stands on z = 0: clips drift by up to 8 cm in
    height.

    The shift follows the lowest sole, smoothed over about 0.2 s; where both feet leave the ground
    (seated with raised feet, in flight) it stays at the clip's own level. A clip that was
    retargeted stands on its floor already and stays as it is.
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


def stretches(mask: np.ndarray) -> list[tuple[int, int]]:
    """(first, one beyond last) of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def find_seats(clip: Clip) -> tuple[list[Seat], bool]:
    """The seats that a floor-mended clip sits on, in order, and whether it lies down anywhere."""
    position, rotation = body_poses(clip)
    pelvis = position[:, 0].numpy().astype(np.float64)
    trunk_up = rotation[:, 1, 2, 2].numpy()
    bottom = seat_clearance(position, rotation)
    velocity = np.gradient(_smooth2(pelvis[:, :2], 0.1 * clip.fps), axis=0) * clip.fps
    speed = np.linalg.norm(velocity, axis=1)
    heading = rotations.heading(torch.from_numpy(clip.local_rotation[:, 0])).numpy()
    lies = bool(((trunk_up < _LYING_TILT) & (pelvis[:, 2] < _LYING_PELVIS_M)).sum() > clip.fps)
    seats = []
    for start, stop in stretches(pelvis[:, 2] < _DOWN_M):
        still = np.arange(start, stop)[speed[start:stop] < _REST_SPEED_M_S]
        if len(still) < _REST_MIN_S * clip.fps:
            continue
        x, y = np.median(pelvis[still, :2], axis=0)
        facing = heading[still].mean(axis=0)
        seats.append(
            Seat(
                point_m=(float(x), float(y), float(np.median(bottom[still]))),
                facing_rad=float(np.arctan2(facing[1], facing[0])),
                from_frame=int(still[0]),
                to_frame=int(still[-1]) + 1,
            )
        )
    # a clip that lies on its side never tilts its trunk that far, but rests on something bed-low
    lies = lies or any(seat.point_m[2] < _LOWEST_SEAT_M for seat in seats)
    lies = lies or bool(_beds(clip))
    return seats, lies


def _smooth2(x: np.ndarray, sigma: float) -> np.ndarray:
    return np.stack([smooth(column, sigma) for column in x.T], axis=1)


def with_seats(clip: Clip) -> list[Clip]:
    """The clip cut so that each part uses at most one seat; none of a clip that lies down.

    Stretches on the same seat (within 0.25 m) are one; where the seats differ, the clip is cut
    half-way between them.
    """
    seats, lies = find_seats(clip)
    if lies:
        return []
    if not seats:
        return [clip]
    groups: list[list[Seat]] = []
    for seat in seats:
        near = (
            groups
            and np.linalg.norm(np.subtract(seat.point_m[:2], groups[-1][-1].point_m[:2])) < 0.25
        )
        if near:
            groups[-1].append(seat)
        else:
            groups.append([seat])
    parts, start = [], 0
    for index, group in enumerate(groups):
        last = index == len(groups) - 1
        stop = clip.frames if last else (group[-1].to_frame + groups[index + 1][0].from_frame) // 2
        longest = max(group, key=lambda s: s.to_frame - s.from_frame)
        name = clip.name if len(groups) == 1 else f"{clip.name}#{index + 1}"
        seat = replace(
            longest,
            from_frame=group[0].from_frame - start,
            to_frame=group[-1].to_frame - start,
        )
        parts.append(replace(clip.part(start, stop), name=name, seat=seat))
        start = stop
    return parts


def with_objects(clip: Clip, task: str) -> list[Clip]:
    """The parts of a floor-mended clip that a task learns from, with what they use of it.

    sit: parts with at most one seat each. lie: with at most one bed. carry: with its box. Objects
    that a clip already knows are kept, and a clip that uses another task's is left out. ChoiceError
    lists the tasks there are.
    """
    if task == "track":
        return with_any(clip)
    if _known(clip):
        return [clip] if serves(clip, task) else []
    return _fitter(task)[1](clip)


def with_any(clip: Clip) -> list[Clip]:
    """A raw clip at 30 Hz, on the floor, in parts with whatever they use: a box, beds, or seats.

    A clip that brings its objects along stays as it is.
    """
    if _known(clip):
        return [clip]
    ready = floor_mended(resampled(clip))
    carried = _with_box(ready)
    if carried[0].box is not None:
        return carried
    lain = _with_beds(ready)
    if lain[0].bed is not None:
        return lain
    return with_seats(ready) or lain


def serves(clip: Clip, task: str) -> bool:
    """Whether the objects that a clip knows are a task's; yes where it knows none."""
    if task == "track":
        return True
    kind, _ = _fitter(task)
    return not _known(clip) or kind in _known(clip)


def _known(clip: Clip) -> list[str]:
    return [kind for kind in ("seat", "bed", "box") if getattr(clip, kind) is not None]


def _fitter(task: str) -> tuple[str, Callable[[Clip], list[Clip]]]:
    if task not in _FITTERS:
        raise ChoiceError("task", task, list(_FITTERS))
    return _FITTERS[task]


def _beds(clip: Clip) -> list[Bed]:
    from world.motions.fit.bed import find_beds

    return find_beds(clip)


def _with_beds(clip: Clip) -> list[Clip]:
    beds = _beds(clip)
    if not beds:
        return [clip]
    stops = [(a.to_frame + b.from_frame) // 2 for a, b in itertools.pairwise(beds)]
    parts = []
    for index, (bed, start, stop) in enumerate(
        zip(beds, [0, *stops], [*stops, clip.frames], strict=True)
    ):
        name = clip.name if len(beds) == 1 else f"{clip.name}#{index + 1}"
        parts.append(replace(clip, name=name, bed=bed).part(start, stop))
    return parts


def _with_box(clip: Clip) -> list[Clip]:
    from world.motions.fit.box import find_box

    return [replace(clip, box=find_box(clip))]


#: Of each task: the object of a clip that it uses, and how that is found.
_FITTERS: dict[str, tuple[str, Callable[[Clip], list[Clip]]]] = {
    "sit": ("seat", with_seats),
    "lie": ("bed", _with_beds),
    "carry": ("box", _with_box),
}

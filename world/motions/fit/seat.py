"""The seats of a clip, fitted to the stretches in which the pelvis rests."""

from dataclasses import replace

import numpy as np
import torch

from world import rotations
from world.motions.clip import Clip
from world.motions.fit.bed import find_beds
from world.motions.fit.poses import body_poses, seat_clearance, smooth, stretches
from world.motions.objects import Seat

#: A pelvis below this is not standing, m (standing: 0.85; seated: 0.45-0.55).
_DOWN_M = 0.64
#: Trunk further than this from vertical and pelvis lower than this: lying, not sitting.
_LYING_TILT = np.cos(np.deg2rad(60.0))
_LYING_PELVIS_M = 0.43
#: A surface below this is a low bed or the floor, m.
_LOWEST_SEAT_M = 0.25
_REST_SPEED_M_S = 0.10
_REST_MIN_S = 0.8


def find_seats(clip: Clip) -> tuple[list[Seat], bool]:
    """The seats that a floor-corrected clip sits on, in order, and whether it lies down."""
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
    # lying on the side does not tilt the trunk that far, but the surface is as low as a bed
    lies = lies or any(seat.point_m[2] < _LOWEST_SEAT_M for seat in seats)
    lies = lies or bool(find_beds(clip))
    return seats, lies


def _smooth2(x: np.ndarray, sigma: float) -> np.ndarray:
    return np.stack([smooth(column, sigma) for column in x.T], axis=1)


def with_seats(clip: Clip) -> list[Clip]:
    """The parts of a clip, each with at most one seat; empty for a clip that lies down.

    Stretches within 0.25 m are on one seat; between different seats the clip is cut half-way.
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

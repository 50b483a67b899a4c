"""The beds of a clip, fitted to the stretches in which the trunk is down and still."""

import itertools
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from world.character import model as character
from world.motions.clip import Clip
from world.motions.fit.poses import body_poses, smooth, stretches
from world.motions.objects import Bed

#: Spheres of the trunk that rest on a bed: body, centre in its frame (m), radius (m).
_TRUNK = (
    ("pelvis", (0.0, 0.0, 0.07), 0.09),
    ("pelvis", (0.0, 0.0, 0.205), 0.07),
    ("torso", (0.0, 0.0, 0.12), 0.11),
)
_HEAD_CENTRE_M = (0.0, 0.0, 0.175)
#: Trunk at least this far from vertical: lying; leaning on a pile of pillows does not count.
_LYING_UP = np.cos(np.deg2rad(60.0))
#: Trunk moving slower than this is at rest, m/s.
_REST_SPEED_M_S = 0.15
_REST_MIN_S = 1.0
#: Rests on a bed with gaps up to this are one, s: the character turns over.
_TURNING_OVER_S = 4.0
#: A surface below this is the floor, m.
_LOWEST_M = 0.12
#: A pelvis above this is up beside the bed, m.
_UP_M = 0.72


def find_beds(clip: Clip) -> list[Bed]:
    """The beds that a floor-corrected clip lies on, in order.

    The surface is the height of the trunk's underside at rest: the median of its three spheres,
    since on a soft mattress the lowest one is too low. Hip and head are the points on it below the
    pelvis and the centre of the head. The access side is where the character comes from and leaves.
    """
    position, rotation = body_poses(clip)
    pelvis = position[:, 0].numpy().astype(np.float64)
    head = point(position, rotation, "head", _HEAD_CENTRE_M)
    chest = position[:, 1].numpy().astype(np.float64)
    trunk_up = rotation[:, 1, 2, 2].numpy()
    under = [point(position, rotation, b, c)[:, 2] - radius for b, c, radius in _TRUNK]
    surface = np.median(np.stack(under), axis=0)
    sigma = 0.1 * clip.fps
    speed = np.stack([np.gradient(smooth(x, sigma)) for x in chest.T], axis=1) * clip.fps
    still = np.linalg.norm(speed, axis=1) < _REST_SPEED_M_S
    # leaning forward on a seat: the chest is above the pelvis, without a bed below it
    on_it = pelvis[:, 2] > surface
    lying = (trunk_up < _LYING_UP) & (pelvis[:, 2] < _UP_M) & on_it
    beds: list[Bed] = []
    for start, stop in joined(stretches(lying), round(_TURNING_OVER_S * clip.fps)):
        rest = np.arange(start, stop)[(still & lying)[start:stop]]
        if len(rest) < _REST_MIN_S * clip.fps:
            continue
        height = float(np.median(surface[rest]))
        if height < _LOWEST_M:
            continue
        hip_x, hip_y = np.median(pelvis[rest, :2], axis=0)
        head_x, head_y = np.median(head[rest, :2], axis=0)
        along = np.array([head_x - hip_x, head_y - hip_y])
        left = np.array([-along[1], along[0]]) / max(float(np.linalg.norm(along)), 1e-6)
        before, after = pelvis[:start], pelvis[stop:]
        beside = [part[part[:, 2] > _UP_M] for part in (before[::-1], after)]
        came = [part[0, :2] - (hip_x, hip_y) for part in beside if len(part)]
        side = left if not came or sum(float(c @ left) for c in came) >= 0 else -left
        beds.append(
            Bed(
                hip_m=(float(hip_x), float(hip_y), height),
                head_m=(float(head_x), float(head_y), height),
                facing_rad=float(np.arctan2(side[1], side[0])),
                from_frame=int(rest[0]),
                to_frame=int(rest[-1]) + 1,
            )
        )
    return beds


def with_beds(clip: Clip) -> list[Clip]:
    """The parts of a clip, each with at most one bed."""
    beds = find_beds(clip)
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


def point(
    position: Tensor, rotation: Tensor, body: str, offset_m: tuple[float, float, float]
) -> np.ndarray:
    """A point of a body, given in its frame, in the world: [T, 3] float64, m."""
    index = character.BODIES.index(body)
    offset = torch.tensor(offset_m, dtype=position.dtype)
    return (position[:, index] + rotation[:, index] @ offset).numpy().astype(np.float64)


def joined(found: list[tuple[int, int]], gap: int) -> list[tuple[int, int]]:
    """Stretches, merged where they are at most `gap` frames apart."""
    result: list[tuple[int, int]] = []
    for start, stop in found:
        if result and start - result[-1][1] <= gap:
            result[-1] = (result[-1][0], stop)
        else:
            result.append((start, stop))
    return result

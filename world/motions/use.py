"""What a clip uses, frame by frame as tensors: a seat, a bed or a box, and how far its use is."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
import torch
from torch import Tensor

from world import rotations
from world.motions import segments
from world.motions.clip import Clip
from world.tasks.task import Affordance

#: Stages of use: approach or leave; sit or lie down, get up, pick up, put down; seated, lying,
#: carrying.
APPROACH, TRANSITION, CONTACT = 0, 1, 2
#: Done with it for good: no stage to start at.
LEFT = -1


@dataclass(frozen=True)
class BoxFrames:
    """A carried box over F frames, in the clips' worlds."""

    position: Tensor
    """[F, 3]: its centre, m."""
    rotation: Tensor
    """[F, 4]: unit quaternion w, x, y, z."""
    velocity: Tensor
    """[F, 3]: of its centre, m/s."""
    angular: Tensor
    """[F, 3]: in the box's own axes, rad/s."""
    size: Tensor
    """[F, 3]: edge lengths along its own axes, m."""
    held: Tensor
    """[F] bool."""
    picked: Tensor
    """[F, 4]: where it stands before it is picked up: centre (m) and yaw (rad)."""
    put: Tensor
    """[F, 4]: where it is put down, likewise."""
    has_put: Tensor
    """[F] bool: whether the clip puts it down."""
    has_picked: Tensor
    """[F] bool: whether the clip picks it up, or begins with it in hand."""


@dataclass(frozen=True)
class Use:
    """What a clip of T frames uses."""

    known: bool
    """Whether the clip has what the task needs; else all is 0."""
    point: Tensor
    """[T, 3]."""
    head: Tensor
    """[T, 3]."""
    facing: Tensor
    """[T, 2]."""
    stage: Tensor
    """[T] int64: APPROACH, TRANSITION, CONTACT, or LEFT."""
    box: BoxFrames


def of(clip: Clip, affordance: Affordance) -> Use:
    """What the clip uses that offers `affordance`."""
    return _READERS[affordance](clip)


def join_boxes(parts: Sequence[BoxFrames]) -> BoxFrames:
    """The frames of all parts."""
    names = [field.name for field in fields(BoxFrames)]
    return BoxFrames(**{name: torch.cat([getattr(p, name) for p in parts]) for name in names})


def _seat(clip: Clip) -> Use:
    seat = clip.seat
    if seat is None:
        return _at(clip, None, None, 0.0, torch.zeros(clip.frames, dtype=torch.int64))
    found = torch.from_numpy(segments.stages(replace(clip, box=None, bed=None)))
    stage = torch.where(found == segments.LEAVE, APPROACH, found)
    return _at(clip, seat.point_m, seat.point_m, seat.facing_rad, stage)


def _bed(clip: Clip) -> Use:
    bed = clip.bed
    if bed is None:
        return _at(clip, None, None, 0.0, torch.zeros(clip.frames, dtype=torch.int64))
    found = torch.from_numpy(segments.stages(clip))
    stage = torch.where(found == segments.LEAVE, APPROACH, found)
    return _at(clip, bed.hip_m, bed.head_m, bed.facing_rad, stage)


def _box(clip: Clip) -> Use:
    nothing = _at(clip, None, None, 0.0, torch.zeros(clip.frames, dtype=torch.int64))
    track = clip.box
    if track is None or not track.held.any():
        return nothing
    pose = torch.from_numpy(track.pose.astype(np.float32))
    rotation = rotations.normalise(pose[:, 3:])
    edges = np.flatnonzero(np.diff(np.concatenate(([0], track.held.astype(np.int8), [0]))))
    found = torch.from_numpy(segments.stages(clip))
    # who has put the box down and leaves has nothing more to do with it
    stage = torch.where(found == segments.LEAVE, LEFT, found)
    first, last = int(edges[0]), min(int(edges[-1]), clip.frames - 1)
    box = BoxFrames(
        position=pose[:, :3],
        rotation=rotation,
        velocity=_rate(pose[:, :3]) * clip.fps,
        angular=_angular(rotation) * clip.fps,
        size=torch.tensor(track.size_m, dtype=torch.float32).expand(clip.frames, -1),
        held=torch.from_numpy(track.held),
        picked=_rest(pose, first).expand(clip.frames, -1),
        put=_rest(pose, last).expand(clip.frames, -1),
        has_put=torch.full((clip.frames,), int(edges[-1]) < clip.frames),
        has_picked=torch.full((clip.frames,), int(edges[0]) > 0),
    )
    return Use(True, nothing.point, nothing.head, nothing.facing, stage, box)


def _at(
    clip: Clip,
    point: tuple[float, ...] | None,
    head: tuple[float, ...] | None,
    facing_rad: float,
    stage: Tensor,
) -> Use:
    def rows(values: tuple[float, ...] | None) -> Tensor:
        return torch.tensor(values or (0.0, 0.0, 0.0), dtype=torch.float32).expand(clip.frames, -1)

    yaw = torch.tensor(facing_rad)
    facing = torch.stack((torch.cos(yaw), torch.sin(yaw))).to(torch.float32)
    facing = facing.expand(clip.frames, -1)
    return Use(point is not None, rows(point), rows(head), facing, stage, _no_box(clip.frames))


def _no_box(frames: int) -> BoxFrames:
    upright = torch.tensor([1.0, 0.0, 0.0, 0.0]).expand(frames, -1)
    nothing, never = torch.zeros(frames, 3), torch.zeros(frames, dtype=torch.bool)
    nowhere = torch.zeros(frames, 4)
    return BoxFrames(
        nothing, upright, nothing, nothing, nothing, never, nowhere, nowhere, never, never
    )


def _rest(pose: Tensor, frame: int) -> Tensor:
    """[4]: centre (m) and yaw (rad) of the box at a frame."""
    cos, sin = rotations.heading(pose[frame, 3:]).unbind(-1)
    return torch.cat((pose[frame, :3], torch.atan2(sin, cos)[None]))


def _rate(values: Tensor) -> Tensor:
    """Central differences a frame of rows [T, k], one-sided at both ends."""
    return torch.gradient(values, dim=0)[0]


def _angular(rotation: Tensor) -> Tensor:
    """[T, 3]: rotation a frame, rad, in the body's own axes: the mean of both neighbours' steps."""
    step = rotations.to_rotation_vector(
        rotations.multiply(rotations.conjugate(rotation[:-1]), rotation[1:])
    )
    ends = torch.cat((step[:1], step, step[-1:]))
    return 0.5 * (ends[1:] + ends[:-1])


def _any(clip: Clip) -> Use:
    return (
        _box(clip) if clip.box is not None else _bed(clip) if clip.bed is not None else _seat(clip)
    )


_READERS: dict[str, Callable[[Clip], Use]] = {
    "sit": _seat,
    "lie": _bed,
    "carry": _box,
    "any": _any,
}

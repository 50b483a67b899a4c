"""A reference to follow: poses, servo set-points, object and contacts of each frame of the clips.

The frames of all clips are concatenated, so a scene's reference is an index of a frame.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import torch
from torch import Tensor

from world import rotations
from world.character import features, servos
from world.character import model as character
from world.errors import ClipError
from world.furniture.piece import Box
from world.initial.squeeze import squeeze
from world.motions import segments
from world.motions.clip import Clip
from world.motions.uses.box import BOX
from world.objects import clearance
from world.scene.box import STAND

#: A box between two holds counts as held, unless it is this close to where it is picked up or put
#: down: m horizontally, m in height.
_RESTS_M, _LEVEL_M = 0.15, 0.05
#: A limb this deep in a resting box passes through it, m; less is an inaccuracy of its size.
_THROUGH_M = 0.03
#: Least number of frames of an episode.
SHORTEST = 15
#: Number of frames of a segment: half a second.
SEGMENT = 15
#: The set-points of a holding reference support a box of this mass, kg. Each hand presses with this
#: multiple of the force that friction needs, plus a constant, N. With half of these forces, and
#: boxes as wide as the gap between the hands, every box carried at a walk slips within 0.5 s.
_NOMINAL_KG, _GRIP, _GRIP_N, _GRAVITY_M_S2, _FRICTION = 2.0, 6.0, 40.0, 9.81, 1.2


@dataclass(frozen=True)
class Reference:
    """F frames of C clips, float32, each in its clip's world, 30 a second."""

    clip: Tensor
    """[F] int64: the clip of a frame."""
    segment: Tensor
    """[F] int64: the half second of its clip that a frame is in, counted through all clips."""
    first: Tensor
    """[C] int64: the first frame of each clip."""
    stop: Tensor
    """[C] int64: one beyond the last that is followed: a clip ends before its body passes through
    the box that it has put down, whose size and place are inferred, or through a solid stand."""
    qpos: Tensor
    """[F, 43]."""
    qvel: Tensor
    """[F, 34]."""
    position: Tensor
    """[F, 15, 3]: of the bodies, m."""
    heading: Tensor
    """[F, 2]: cosine and sine of the root's heading."""
    coordinates: Tensor
    """[F, 28]: joint coordinates, as the servos measure them, rad."""
    set_point: Tensor
    """[F, 28]: set-points of the frame before, by which the joints reach this one, within the
    bounds of actions, rad: q + kd/kp q̇, and an offset of the arms that grips a held box."""
    boxed: Tensor
    """[C] bool: whether the clip has a box."""
    box: Tensor
    """[F, 7]: the box's centre, m, and rotation, unit quaternion w, x, y, z."""
    box_velocity: Tensor
    """[F, 6]: of its centre, m/s, and angular, in its own axes, rad/s."""
    size: Tensor
    """[C, 3]: the box's edge lengths, m."""
    held: Tensor
    """[F] bool: both hands hold the box."""
    picked: Tensor
    """[C, 4]: where the box is picked up: centre, m, and yaw, rad."""
    has_picked: Tensor
    """[C] bool: whether it is picked up in the clip; else it is in hand from the first frame."""
    put: Tensor
    """[C, 4]: where it is put down."""
    has_put: Tensor
    """[C] bool: whether it is put down in the clip."""
    start_weight: Tensor
    """[F] float64: relative probability that an episode starts at a frame; 0: never."""

    @property
    def clips(self) -> int:
        """C."""
        return len(self.first)

    def ahead(self, frame: Tensor, steps: int) -> Tensor:
        """Return the frames [n] `steps` control steps after `frame` [n], clamped to the clips'
        last."""
        return torch.minimum(frame + steps, self.stop[self.clip[frame]] - 1)

    def harder(self, failures: Tensor) -> Tensor:
        """Return relative failure rates [F] float64, of mean 1.

        failures: episodes that failed in each segment [up to S]. A failure counts for its own
        segment and, less, for the two before it, which lead to it.
        """
        count = int(self.segment[-1]) + 1
        failed = torch.zeros(count, dtype=torch.float64)
        failed[: len(failures)] = failures.double()[:count]
        clip = torch.zeros(count, dtype=torch.int64)
        clip[self.segment] = self.clip
        total = failed.clone()
        for later, share in ((1, 0.8), (2, 0.5)):
            same = clip[later:] == clip[:-later]
            total[:-later] += torch.where(same, share * failed[later:], 0.0)
        frames = total[self.segment]
        return frames / frames.mean() if bool(frames.any()) else torch.ones_like(frames)


def reference(
    clips: Sequence[Clip],
    handling_weight: float = 1.0,
    solid: bool = False,
    starts: bool = True,
) -> Reference:
    """Return the reference of `clips`; ClipError where none is long enough.

    handling_weight: relative probability of initial states in frames in which the clip reaches for
    its box, lifts it or lowers it. solid: boxes rest on solid stands. starts:
    False where no initial state is drawn, which saves half of the time; all weights are then 0.
    """
    parts = [
        _frames(clip, number, handling_weight if starts else None, solid)
        for number, clip in enumerate(clips)
    ]
    lengths = torch.tensor([clip.frames for clip in clips])
    first = lengths.cumsum(0) - lengths
    stop = first + torch.stack([part.pop("frames") for part in parts])
    joined = {
        name: torch.stack([part[name] for part in parts])
        if name in _BY_CLIP
        else torch.cat([part[name] for part in parts])
        for name in parts[0]
    }
    halves = [torch.arange(clip.frames) // SEGMENT for clip in clips]
    counts = torch.tensor([int(half[-1]) + 1 for half in halves])
    before = (counts.cumsum(0) - counts).tolist()
    segment = torch.cat([half + start for half, start in zip(halves, before, strict=True)])
    found = Reference(segment=segment, first=first, stop=stop, **joined)
    if starts and not bool((found.start_weight > 0).any()):
        raise ClipError(f"no clip to follow: each needs more than {SHORTEST} sound frames")
    return found


_BY_CLIP = ("boxed", "size", "picked", "has_picked", "put", "has_put")
assert {f.name for f in fields(Reference)}.issuperset(_BY_CLIP)


def _frames(clip: Clip, number: int, weight: float | None, solid: bool) -> dict[str, Tensor]:
    qpos, qvel = torch.from_numpy(clip.qpos()), torch.from_numpy(clip.qvel())
    body = features.body(qpos, qvel)
    coordinates = servos.coordinates(qpos)
    found = {
        "clip": torch.full((clip.frames,), number),
        "qpos": qpos,
        "qvel": qvel,
        "position": body.position,
        "heading": body.heading,
        "coordinates": coordinates,
    }
    found |= _box(clip)
    found["set_point"] = _set_points(qpos, qvel, coordinates, found["held"])
    centres = clearance.points(qpos)[:, clearance.LIMBS]
    begin, end = _free(found, clip, centres, solid)
    found["frames"] = torch.tensor(end)
    if weight is None:
        return found | {"start_weight": torch.zeros(clip.frames, dtype=torch.float64)}
    sound = torch.from_numpy(segments.usable(clip)).clone()
    if solid:
        sound &= _in_stands(centres, found, STAND.boxes) < clearance.THROWN_M
    sound[:begin] = False
    sound[max(0, end - SHORTEST) :] = False
    handled = torch.from_numpy(segments.stages(clip) == segments.TRANSITION)
    found["start_weight"] = sound.double() * torch.where(handled, weight, 1.0)
    return found


def _free(found: dict[str, Tensor], clip: Clip, centres: Tensor, solid: bool) -> tuple[int, int]:
    """Return (first, one beyond last) of the frames about the holds in which no limb but the arms
    is in the resting box, or after the grip in the column of a solid stand: thighs come over its
    plate as people bend."""
    held = torch.nonzero(found["held"]).flatten()
    if not len(held):
        return 0, clip.frames
    inside = clearance.limb_depth(centres, found["box"], 0.5 * found["size"]) > _THROUGH_M
    clash = torch.nonzero(inside & ~found["held"]).flatten()
    before, after = clash[clash < held[0]], clash[clash > held[-1]]
    begin = int(before[-1]) + 1 if len(before) else 0
    ends = [clip.frames, *after[:1].tolist()]
    if solid:
        through = torch.nonzero(_in_stands(centres, found, (clearance.COLUMN,)) > 0.0).flatten()
        ends += through[through > held[0]][:1].tolist()
    return begin, min(ends)


def _in_stands(centres: Tensor, found: dict[str, Tensor], parts: Sequence[Box]) -> Tensor:
    """[T]: deepest penetration of the limbs into parts of the stands that the box is taken from and
    put down on, m; negative for clearance."""
    half_height = 0.5 * found["size"][2:]
    deepest = torch.full((len(centres),), -torch.inf)
    for name in ("picked", "put"):
        if bool(found[f"has_{name}"]):
            depth = clearance.stand_depth(centres, found[name][None], half_height, parts)
            deepest = torch.maximum(deepest, depth)
    return deepest


def _set_points(qpos: Tensor, qvel: Tensor, coordinates: Tensor, held: Tensor) -> Tensor:
    kp, kd = (torch.from_numpy(gain).to(torch.float32) for gain in character.gains())
    low, high = (
        torch.from_numpy(bound).to(torch.float32) for bound in character.set_point_bounds()
    )
    wanted = coordinates + kd / kp * qvel[:, 6:]
    weight = torch.where(held, _NOMINAL_KG * _GRAVITY_M_S2, 0.0)
    press = _GRIP * weight / (2.0 * _FRICTION) + torch.where(held, _GRIP_N, 0.0)
    wanted = wanted + squeeze(qpos, press, weight)
    return torch.maximum(torch.minimum(wanted, high), low)


def _box(clip: Clip) -> dict[str, Tensor]:
    """Return the fields of the box; zeros where the clip has none."""
    known = BOX.read(clip)
    track = known.box
    held = track.held.clone()
    pose = torch.cat((track.position, track.rotation), dim=1)
    velocity = torch.cat((track.velocity, track.angular), dim=1)
    picked, put = track.picked[0].clone(), track.put[0].clone()
    if known.has_object:
        inside = torch.nonzero(held).flatten()
        between = torch.arange(clip.frames)
        between = (between > inside[0]) & (between < inside[-1])
        aside = ~_at(pose, picked) & ~_at(pose, put)
        held |= between & aside
        late = _nearer(pose, put, picked) | (torch.arange(clip.frames) > inside[-1])
        pose = _rested(pose, ~held & ~late, picked)
        pose = _rested(pose, ~held & late, put)
        velocity = torch.where(held[:, None], velocity, 0.0)
    return {
        "boxed": torch.tensor(known.has_object),
        "box": pose.contiguous(),
        "box_velocity": velocity,
        "size": track.size[0].clone(),
        "held": held,
        "picked": picked,
        "has_picked": track.has_picked[0].clone(),
        "put": put,
        "has_put": track.has_put[0].clone(),
    }


def _at(pose: Tensor, spot: Tensor) -> Tensor:
    """[T] bool: the box is at `spot` [4]."""
    off = pose[:, :3] - spot[:3]
    return (off[:, :2].norm(dim=1) < _RESTS_M) & (off[:, 2].abs() < _LEVEL_M)


def _nearer(pose: Tensor, spot: Tensor, other: Tensor) -> Tensor:
    """[T] bool: the box is nearer to `spot` [4] than to `other` [4]."""
    return (pose[:, :3] - spot[:3]).norm(dim=1) < (pose[:, :3] - other[:3]).norm(dim=1)


def _rested(pose: Tensor, resting: Tensor, spot: Tensor) -> Tensor:
    """Return poses [T, 7] with the box level at `spot` [4] in frames `resting` [T]."""
    yaw = torch.stack((torch.cos(spot[3]), torch.sin(spot[3])))
    rest = torch.cat((spot[:3], rotations.from_heading(yaw)))
    return torch.where(resting[:, None], rest, pose)

"""A set of clips as tensors: where episodes start from, and what the discriminator takes for real.

Everything is drawn by counter (world.streams), so that a batch of mocap is the same wherever it is
drawn.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from world import character, features, rotations, streams
from world.errors import ClipError
from world.motions import fit
from world.motions.clip import Clip, mirrored

#: Pelvis height from which a frame counts as upright, m.
_UPRIGHT_M = 0.72
#: An upright frame slower than this, and turning slower, is idle: m/s, rad/s.
_IDLE_M_S, _IDLE_RAD_S = 0.3, 0.4
#: Of the idle frames one in so many is kept: people wait a lot before and after they sit, and a
#: discriminator that has seen it rewards a character for standing where it is.
_IDLE_EVERY = 12
#: Every 20th second of motion is held out to measure the discriminator on.
_HELD_OUT_EVERY = 20
#: Seconds before (and after) the seated stretch that count as sitting down (and getting up).
_TRANSITION_S = 2.5


@dataclass(frozen=True)
class Frames:
    """States drawn from the clips: the character and the seat of its clip."""

    qpos: Tensor
    """[n, 43] float32, in the clip's world."""
    qvel: Tensor
    """[n, 34]."""
    seat: Tensor
    """[n, 3]: the point on the seat below the pelvis, clip's world, m; 0 where the clip has
    none."""
    facing: Tensor
    """[n, 2]: cosine and sine of the seat's facing."""


class MotionLibrary:
    """All frames of all clips (and of their mirror images), with what sampling needs to know of
    each."""

    def __init__(self, clips: Sequence[Clip], mirror: bool = True) -> None:
        if not clips:
            raise ClipError("no clips: --motions names files or folders with clips (.npz)")
        both = [c for clip in clips for c in ((clip, mirrored(clip)) if mirror else (clip,))]
        self.clips = tuple(both)
        self.qpos = torch.cat([torch.from_numpy(c.qpos()) for c in both])
        self.qvel = torch.cat([torch.from_numpy(c.qvel()) for c in both])
        self.body = features.body(self.qpos, self.qvel)
        self.seat = torch.cat([_per_frame(c, _seat_point(c)) for c in both])
        self.facing = torch.cat([_per_frame(c, _seat_facing(c)) for c in both])
        has_seat = torch.cat([torch.full((c.frames,), c.seat is not None) for c in both])
        has_next = torch.cat([torch.arange(c.frames) < c.frames - 1 for c in both])
        second = torch.cat([torch.arange(c.frames) // c.fps for c in both])
        held_out = second % _HELD_OUT_EVERY == _HELD_OUT_EVERY // 2
        upright = self.qpos[:, 2] > _UPRIGHT_M
        stage = torch.cat([_stages(c) for c in both])
        idle = (self.qvel[:, :2].norm(dim=1) < _IDLE_M_S) & (
            self.body.angular_velocity[:, 2].abs() < _IDLE_RAD_S
        )
        dull = upright & idle & (stage == 0) & (torch.arange(len(idle)) % _IDLE_EVERY != 0)
        has_next &= ~dull
        #: Upright frames that have a successor: locomotion, wherever an object may be, few of them
        #: idle; most of them from clips without a seat, which walk for longer and faster.
        self.upright = _mostly(
            torch.nonzero(upright & has_next & ~held_out & ~has_seat).flatten(),
            torch.nonzero(upright & has_next & ~held_out & has_seat).flatten(),
        )
        #: Frames by stage of using the seat: approach or leave, sit down or get up, seated.
        self.stages = tuple(
            torch.nonzero(has_seat & (stage == s) & has_next & ~held_out).flatten()
            for s in range(3)
        )
        self.held_out = torch.nonzero(has_next & held_out & (upright | has_seat)).flatten()
        self.has_seat = has_seat
        if not len(self.upright):
            raise ClipError("the clips never stand or walk: none of their frames is upright")

    @property
    def frames(self) -> int:
        return self.qpos.shape[0]

    def at(self, index: Tensor) -> Frames:
        """The frames of the given indices [n]."""
        return Frames(self.qpos[index], self.qvel[index], self.seat[index], self.facing[index])


def servo_coordinates(qpos: Tensor) -> Tensor:
    """What the 28 servoes measure at qpos [n, 43]: rotation vectors of balls, hinge angles, rad [n,
    28]."""
    parts = []
    address = 7
    for joint in character.JOINTS:
        if joint.is_ball:
            parts.append(rotations.to_rotation_vector(qpos[:, address : address + 4]))
            address += 4
        else:
            parts.append(qpos[:, address : address + 1])
            address += 1
    return torch.cat(parts, dim=1)


def _mostly(wanted: Tensor, other: Tensor, share: float = 0.8) -> Tensor:
    """Both index sets, `wanted` repeated until it makes up about `share` of them."""
    if not len(wanted):
        return other
    repeats = max(1, round(share / (1 - share) * len(other) / len(wanted)))
    return torch.cat((other, wanted.repeat(repeats)))


def _per_frame(clip: Clip, row: Tensor) -> Tensor:
    return row.expand(clip.frames, -1)


def _seat_point(clip: Clip) -> Tensor:
    return torch.tensor(clip.seat.point_m if clip.seat else (0.0, 0.0, 0.0), dtype=torch.float32)


def _seat_facing(clip: Clip) -> Tensor:
    yaw = torch.tensor(clip.seat.facing_rad if clip.seat else 0.0)
    return torch.stack((torch.cos(yaw), torch.sin(yaw))).to(torch.float32)


def _stages(clip: Clip) -> Tensor:
    """0 approach or leave, 1 sitting down or getting up, 2 seated: [T]."""
    stage = torch.zeros(clip.frames, dtype=torch.int64)
    if clip.seat is not None:
        margin = round(_TRANSITION_S * clip.fps)
        stage[max(0, clip.seat.from_frame - margin) : clip.seat.to_frame + margin] = 1
        stage[clip.seat.from_frame : clip.seat.to_frame] = 2
    return stage


@dataclass(frozen=True)
class StyleMixture:
    """What share of the discriminator's mocap is what."""

    locomotion: float = 0.45
    """Upright frames of any clip, with an imaginary object anywhere."""
    approach: float = 0.2
    """Frames of clips with a seat, before and after its use."""
    transition: float = 0.2
    """Sitting down and getting up."""
    seated: float = 0.15
    object_m: tuple[float, float] = (0.8, 10.0)
    """How far off the imaginary object is."""


class StyleSource:
    """Mocap transitions (s, s') for the discriminator, with the object that each state needs."""

    def __init__(self, library: MotionLibrary, seed: int, mixture: StyleMixture) -> None:
        self._library, self._seed, self._mixture = library, seed, mixture
        shares = [mixture.locomotion]
        stage_shares = (mixture.approach, mixture.transition, mixture.seated)
        shares += [
            share if len(frames) else 0.0
            for share, frames in zip(stage_shares, library.stages, strict=True)
        ]
        total = torch.tensor(shares, dtype=torch.float64)
        self._edges = (total / total.sum()).cumsum(0).to(torch.float32)
        self._pools = (library.upright, *library.stages)

    def sample(self, n: int, counter: int) -> tuple[Tensor, Tensor]:
        """n transitions of the training frames, (s, s') float32 [n, 114] each; the same for a
        counter."""
        u = streams.uniform(self._seed, streams.MOCAP, torch.arange(n), counter, 5)
        kind = torch.bucketize(u[:, 0].contiguous(), self._edges[:-1], right=True)
        index = torch.empty(n, dtype=torch.int64)
        for k, pool in enumerate(self._pools):
            rows = kind == k
            if len(pool):
                index[rows] = pool[(u[rows, 1] * len(pool)).long().clamp_max(len(pool) - 1)]
        return self._pairs(index, kind == 0, u[:, 2:])

    def held_out(self, n: int, counter: int) -> tuple[Tensor, Tensor]:
        """As `sample`, of the frames that `sample` never draws."""
        pool = self._library.held_out
        if not len(pool):
            pool = self._library.upright
        u = streams.uniform(self._seed, streams.MOCAP, torch.arange(n) + (1 << 40), counter, 5)
        index = pool[(u[:, 1] * len(pool)).long().clamp_max(len(pool) - 1)]
        imaginary = (u[:, 0] < self._mixture.locomotion) & (
            self._library.qpos[index, 2] > _UPRIGHT_M
        )
        return self._pairs(index, imaginary | ~self._library.has_seat[index], u[:, 2:])

    def _pairs(self, index: Tensor, imaginary: Tensor, u: Tensor) -> tuple[Tensor, Tensor]:
        library = self._library
        root = library.qpos[index, :3]
        near, far = self._mixture.object_m
        distance = near + (far - near) * u[:, 0]
        angle = 2 * torch.pi * u[:, 1:]
        offset = distance[:, None] * torch.stack((angle[:, 0].cos(), angle[:, 0].sin()), 1)
        yaw = torch.stack((angle[:, 1].cos(), angle[:, 1].sin()), dim=1)
        point = torch.where(imaginary[:, None], root[:, :2] + offset, library.seat[index, :2])
        facing = torch.where(imaginary[:, None], yaw, library.facing[index])
        place = torch.cat((point, torch.zeros_like(point[:, :1])), dim=1)

        def state(frames: Tensor) -> Tensor:
            around = features.object_features(
                library.qpos[frames, :3], library.body.heading[frames], place, facing
            )
            return torch.cat((library.body.features[frames], around), dim=1)

        return state(index), state(index + 1)


def prepare(clip: Clip) -> list[Clip]:
    """A raw clip made ready for the sit task: 30 Hz, on the floor, cut so that each part has one
    seat."""
    return fit.with_seats(fit.floor_mended(fit.resampled(clip)))

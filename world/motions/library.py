"""A set of clips as tensors: reference states, and mocap transitions for the discriminator.

All draws are counter-based (world.random_streams), so that a batch of mocap is the same in every
process.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from world import random_streams
from world.character import features
from world.errors import ClipError
from world.motions import segments
from world.motions.clip import Clip, mirrored
from world.motions.mixture import StyleMixture
from world.motions.uses.seat import SEAT
from world.motions.uses.use import CONTACT, UPRIGHT_M, ClipUse, WindowBatch

__all__ = ["Frames", "MotionLibrary", "StyleMixture", "StyleSource"]

#: An upright frame with less than these speeds is idle: m/s, rad/s; below the third it is slow,
#: m/s.
_IDLE_M_S, _IDLE_RAD_S = 0.3, 0.4
_SLOW_M_S = 0.4
#: Every 20th second of motion is held out for the discriminator's validation.
_HELD_OUT_EVERY = 20


@dataclass(frozen=True)
class Frames:
    """States of n frames: the character and the use point of its clip."""

    qpos: Tensor
    """[n, 43] float32, in the clip's world."""
    qvel: Tensor
    """[n, 34]."""
    seat: Tensor
    """[n, 3]: the point below the pelvis on the seat or bed, clip's world, m; 0 without one."""
    facing: Tensor
    """[n, 2]: cosine and sine of the seat's facing, or of a bed's access side."""
    head: Tensor
    """[n, 3]: the point below the head on the bed; of a seat, the same point as `seat`."""


class MotionLibrary:
    """All frames of all clips (and of their mirror images), with index sets for sampling.

    The objects of the clips are those that `use` reads.
    """

    def __init__(self, clips: Sequence[Clip], mirror: bool = True, use: ClipUse = SEAT) -> None:
        if not clips:
            raise ClipError(use.none)  # there were clips, and `use` takes none of them
        both = [c for clip in clips for c in ((clip, mirrored(clip)) if mirror else (clip,))]
        self.clips = tuple(both)
        self.qpos = torch.cat([torch.from_numpy(c.qpos()) for c in both])
        self.qvel = torch.cat([torch.from_numpy(c.qvel()) for c in both])
        self.body = features.body(self.qpos, self.qvel)
        uses = [use.read(clip) for clip in both]
        self.use = use
        self.seat = torch.cat([u.point for u in uses])
        self.head = torch.cat([u.head for u in uses])
        self.facing = torch.cat([u.facing for u in uses])
        #: The boxes of the clips, frame by frame; valid where has_seat holds.
        self.box = use.boxes(uses)
        has_seat = torch.cat([torch.full((len(u.stage),), u.has_object) for u in uses])
        has_next = torch.cat([torch.arange(c.frames) < c.frames - 1 for c in both])
        second = torch.cat([torch.arange(c.frames) // c.fps for c in both])
        held_out = second % _HELD_OUT_EVERY == _HELD_OUT_EVERY // 2
        upright = self.qpos[:, 2] > UPRIGHT_M
        stage = torch.cat([u.stage for u in uses])
        idle = (self.qvel[:, :2].norm(dim=1) < _IDLE_M_S) & (
            self.body.angular_velocity[:, 2].abs() < _IDLE_RAD_S
        )
        dull = upright & idle & (stage == 0) & (torch.arange(len(idle)) % use.idle_every != 0)
        has_next &= ~dull & torch.cat([u.kept for u in uses])
        has_next &= torch.cat([torch.from_numpy(segments.usable(c)) for c in both])
        if use.holds and self.box is not None:
            # hands that hold a box are none of a walk to it; clips that show nothing else keep it
            free = upright & ~self.box.held
            upright = free if bool((free & has_next & ~held_out).any()) else upright
        #: Whether a frame may have its object elsewhere.
        self.walks = upright
        #: Upright frames with a successor, for locomotion with relocated objects: few are idle,
        #: most are from clips without an object, which walk for longer and faster.
        self.upright = _mostly(
            torch.nonzero(upright & has_next & ~held_out & ~has_seat).flatten(),
            torch.nonzero(upright & has_next & ~held_out & has_seat).flatten(),
        )
        #: The slow ones of these, for initial states with furniture close by.
        self.slow = self.upright[self.qvel[self.upright, :2].norm(dim=1) < _SLOW_M_S]
        #: Frames by stage: approach or leave, transition, contact.
        self.stages = tuple(
            torch.nonzero(has_seat & (stage == s) & has_next & ~held_out).flatten()
            for s in range(3)
        )
        leaving = torch.cat([_leaving((u.stage == CONTACT) | u.box.held) for u in uses])
        #: The same for reference states: without frames after the use, and without unfit ones.
        out = leaving | use.unfit(self)
        self.start_stages = tuple(pool[~out[pool]] for pool in self.stages)
        #: Number of each frame in its clip.
        self.number = torch.cat([torch.arange(c.frames) for c in both])
        self.held_out = torch.nonzero(has_next & held_out & (upright | has_seat)).flatten()
        self.has_seat = has_seat
        if not len(self.upright):
            raise ClipError("the clips never stand or walk: none of their frames is upright")

    @property
    def frames(self) -> int:
        return self.qpos.shape[0]

    def at(self, index: Tensor) -> Frames:
        """The frames of the given indices [n]."""
        return Frames(
            self.qpos[index],
            self.qvel[index],
            self.seat[index],
            self.facing[index],
            self.head[index],
        )


def _leaving(used: Tensor) -> Tensor:
    """[T] bool: the frames after the last use, `used` [T] bool; none without use."""
    frames = torch.nonzero(used)
    last = int(frames.max()) if len(frames) else len(used)
    return torch.arange(len(used)) > last


def _mostly(wanted: Tensor, other: Tensor, fraction: float = 0.8) -> Tensor:
    """Both index sets, with `wanted` repeated to about the fraction `fraction` of them."""
    if not len(wanted):
        return other
    repeats = max(1, round(fraction / (1 - fraction) * len(other) / len(wanted)))
    return torch.cat((other, wanted.repeat(repeats)))


class StyleSource:
    """Sampler of windows of mocap states with the features of their objects; a window of 2 is a
    transition (s, s')."""

    def __init__(
        self, library: MotionLibrary, seed: int, mixture: StyleMixture, window: int = 2
    ) -> None:
        """Raises ClipError where no upright frame has so many before it."""
        self._library, self._seed, self._mixture = library, seed, mixture
        self._window = window
        pools = [self._whole(pool) for pool in (library.upright, *library.stages)]
        if not len(pools[0]):
            raise ClipError(f"a window of {window} states is longer than every clip")
        fractions = [mixture.locomotion]
        stage_fractions = (mixture.approach, mixture.transition, mixture.seated)
        fractions += [
            fraction if len(frames) else 0.0
            for fraction, frames in zip(stage_fractions, pools[1:], strict=True)
        ]
        total = torch.tensor(fractions, dtype=torch.float64)
        self._edges = (total / total.sum()).cumsum(0).to(torch.float32)
        self._pools = tuple(pools)
        held_out = self._whole(library.held_out)
        self._held_out = held_out if len(held_out) else pools[0]

    def _whole(self, pool: Tensor) -> Tensor:
        """The frames of a pool that have enough frames of their clip before them."""
        return pool[self._library.number[pool] >= self._window - 2]

    def sample(self, n: int, counter: int) -> tuple[Tensor, ...]:
        """n windows of the training frames, their states in order, float32 [n, 114] each; a pure
        function of the counter."""
        u = random_streams.uniform(self._seed, random_streams.MOCAP, self._numbers(n), counter, 7)
        kind = torch.bucketize(u[:, 0].contiguous(), self._edges[:-1], right=True)
        index = torch.zeros_like(kind)
        for k, pool in enumerate(self._pools):
            if len(pool):
                drawn = pool[(u[:, 1] * len(pool)).long().clamp_max(len(pool) - 1)]
                index = torch.where(kind == k, drawn, index)
        return self._windows(index, kind == 0, u[:, 2:])

    def _numbers(self, n: int) -> Tensor:
        return torch.arange(n, device=self._edges.device)

    def held_out(self, n: int, counter: int) -> tuple[Tensor, ...]:
        """n windows of the held-out frames, otherwise as `sample`."""
        pool = self._held_out
        u = random_streams.uniform(
            self._seed, random_streams.MOCAP, self._numbers(n) + (1 << 40), counter, 7
        )
        index = pool[(u[:, 1] * len(pool)).long().clamp_max(len(pool) - 1)]
        relocated = (u[:, 0] < self._mixture.locomotion) & self._library.walks[index]
        return self._windows(index, relocated | ~self._library.has_seat[index], u[:, 2:])

    def _windows(self, index: Tensor, relocated: Tensor, u: Tensor) -> tuple[Tensor, ...]:
        library = self._library
        root = library.qpos[index, :3]
        near, far = self._mixture.object_m
        distance = near + (far - near) * u[:, 0]
        angle = 2 * torch.pi * u[:, 1:3]
        offset = distance[:, None] * torch.stack((angle[:, 0].cos(), angle[:, 0].sin()), 1)
        yaw = torch.stack((angle[:, 1].cos(), angle[:, 1].sin()), dim=1)
        anywhere = root[:, :2] + offset
        batch = WindowBatch(index, relocated, anywhere, yaw, u[:, 3])
        return library.use.windows(library, batch, self._mixture, self._window)


class MixedSource:
    """Mocap of several tasks, a fixed part of each batch from each task's clips."""

    def __init__(self, sources: Sequence[StyleSource], shares: Sequence[float]) -> None:
        self._sources = tuple(sources)
        edges = torch.tensor(shares, dtype=torch.float64).cumsum(0)
        self._edges = (edges / edges[-1]).tolist()

    def sample(self, n: int, counter: int) -> tuple[Tensor, ...]:
        """As StyleSource.sample."""
        return _stacked([s.sample(m, counter) for s, m in self._parts(n)])

    def held_out(self, n: int, counter: int) -> tuple[Tensor, ...]:
        """As StyleSource.held_out."""
        return _stacked([s.held_out(m, counter) for s, m in self._parts(n)])

    def _parts(self, n: int) -> list[tuple[StyleSource, int]]:
        stops = [round(n * edge) for edge in self._edges]
        counts = [b - a for a, b in zip([0, *stops[:-1]], stops, strict=True)]
        return [(s, m) for s, m in zip(self._sources, counts, strict=True) if m]


def _stacked(parts: list[tuple[Tensor, ...]]) -> tuple[Tensor, ...]:
    return tuple(torch.cat(states) for states in zip(*parts, strict=True))

"""A set of clips as tensors: where episodes start from, and what the discriminator takes for real.

Everything is drawn by counter (world.random_streams), so that a batch of mocap is the same
wherever it is drawn.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from world import random_streams, rotations
from world.character import features
from world.errors import ClipError
from world.motions import segments, use
from world.motions.clip import Clip, mirrored
from world.motions.fit import ground
from world.tasks.carry import GROUND_M

#: Lowest centre of a box that an episode may start with, m: people pick boxes up from the floor.
_BOX_M = GROUND_M + 0.05
#: Pelvis height from which a frame counts as upright, m.
_UPRIGHT_M = 0.72
#: Root height from which a character stands on its feet, m.
_STANDS_M = 0.75
#: An upright frame slower than this, and turning slower, is idle: m/s, rad/s; one slower than the
#: third hardly moves, m/s.
_IDLE_M_S, _IDLE_RAD_S = 0.3, 0.4
_SLOW_M_S = 0.4
#: Of the idle frames one in so many is kept: people wait a lot before and after they sit, and a
#: discriminator that has seen it rewards a character for standing where it is.
_IDLE_EVERY = 12
#: Every 20th second of motion is held out to measure the discriminator on.
_HELD_OUT_EVERY = 20


@dataclass(frozen=True)
class Frames:
    """States drawn from the clips: the character and the seat of its clip."""

    qpos: Tensor
    """[n, 43] float32, in the clip's world."""
    qvel: Tensor
    """[n, 34]."""
    seat: Tensor
    """[n, 3]: the point below the pelvis on the seat or bed, clip's world, m; 0 where the clip has
    none."""
    facing: Tensor
    """[n, 2]: cosine and sine of the seat's facing; of the side that a bed is got onto by."""
    head: Tensor
    """[n, 3]: the point below the head on the bed; the seat's own point."""


class MotionLibrary:
    """All frames of all clips (and of their mirror images), with what sampling needs to know of
    each.

    Of what a clip uses, that counts which offers the task's `affordance`.
    """

    def __init__(
        self, clips: Sequence[Clip], mirror: bool = True, affordance: use.Affordance = "sit"
    ) -> None:
        if not clips:
            raise ClipError("no clips: --motions names files or folders with clips (.npz)")
        both = [c for clip in clips for c in ((clip, mirrored(clip)) if mirror else (clip,))]
        self.clips = tuple(both)
        self.qpos = torch.cat([torch.from_numpy(c.qpos()) for c in both])
        self.qvel = torch.cat([torch.from_numpy(c.qvel()) for c in both])
        self.body = features.body(self.qpos, self.qvel)
        uses = [use.of(clip, affordance) for clip in both]
        self.affordance: use.Affordance = affordance
        self.seat = torch.cat([u.point for u in uses])
        self.head = torch.cat([u.head for u in uses])
        self.facing = torch.cat([u.facing for u in uses])
        #: The box that the clips carry, frame by frame; it counts where has_seat does.
        self.box = use.join_boxes([u.box for u in uses]) if affordance == "carry" else None
        has_seat = torch.cat([torch.full((len(u.stage),), u.known) for u in uses])
        has_next = torch.cat([torch.arange(c.frames) < c.frames - 1 for c in both])
        second = torch.cat([torch.arange(c.frames) // c.fps for c in both])
        held_out = second % _HELD_OUT_EVERY == _HELD_OUT_EVERY // 2
        upright = self.qpos[:, 2] > _UPRIGHT_M
        stage = torch.cat([u.stage for u in uses])
        idle = (self.qvel[:, :2].norm(dim=1) < _IDLE_M_S) & (
            self.body.angular_velocity[:, 2].abs() < _IDLE_RAD_S
        )
        dull = upright & idle & (stage == 0) & (torch.arange(len(idle)) % _IDLE_EVERY != 0)
        has_next &= ~dull
        has_next &= torch.cat([torch.from_numpy(segments.usable(c)) for c in both])
        #: Upright frames that have a successor: locomotion, wherever an object may be, few of them
        #: idle; most of them from clips without a seat, which walk for longer and faster.
        self.upright = _mostly(
            torch.nonzero(upright & has_next & ~held_out & ~has_seat).flatten(),
            torch.nonzero(upright & has_next & ~held_out & has_seat).flatten(),
        )
        #: Of these, the ones that hardly move: they may start where furniture is close.
        self.slow = self.upright[self.qvel[self.upright, :2].norm(dim=1) < _SLOW_M_S]
        #: Frames by stage of using the seat: approach or leave, sit down or get up, seated.
        self.stages = tuple(
            torch.nonzero(has_seat & (stage == s) & has_next & ~held_out).flatten()
            for s in range(3)
        )
        leaving = torch.cat([_leaving(u.stage) for u in uses])
        #: The same without what comes after the use, for episodes do not start on the way out, and
        #: without boxes so low that the episode would end at once.
        out = leaving if self.box is None else leaving | (self.box.position[:, 2] < _BOX_M)
        self.start_stages = tuple(pool[~out[pool]] for pool in self.stages)
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


def _leaving(stage: Tensor) -> Tensor:
    """[T] bool: the frames after the last of use; none where nothing is used."""
    contact = torch.nonzero(stage == use.CONTACT)
    last = int(contact.max()) if len(contact) else len(stage)
    return torch.arange(len(stage)) > last


def _mostly(wanted: Tensor, other: Tensor, share: float = 0.8) -> Tensor:
    """Both index sets, `wanted` repeated until it makes up about `share` of them."""
    if not len(wanted):
        return other
    repeats = max(1, round(share / (1 - share) * len(other) / len(wanted)))
    return torch.cat((other, wanted.repeat(repeats)))


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
    raised_m: tuple[float, float] = (0.0, 0.35)
    """How much higher than its own a bed is that a clip's character lies on: the mocap's are as low
    as 0.15-0.21 m, the catalogue's 0.29-0.70 m."""
    box_height_m: tuple[float, float] = (0.5, 1.1)
    """Height of an imaginary box' centre."""


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
        u = random_streams.uniform(self._seed, random_streams.MOCAP, self._numbers(n), counter, 7)
        kind = torch.bucketize(u[:, 0].contiguous(), self._edges[:-1], right=True)
        index = torch.empty_like(kind)
        for k, pool in enumerate(self._pools):
            rows = kind == k
            if len(pool):
                index[rows] = pool[(u[rows, 1] * len(pool)).long().clamp_max(len(pool) - 1)]
        return self._pairs(index, kind == 0, u[:, 2:])

    def _numbers(self, n: int) -> Tensor:
        return torch.arange(n, device=self._edges.device)

    def held_out(self, n: int, counter: int) -> tuple[Tensor, Tensor]:
        """As `sample`, of the frames that `sample` never draws."""
        pool = self._library.held_out
        if not len(pool):
            pool = self._library.upright
        u = random_streams.uniform(
            self._seed, random_streams.MOCAP, self._numbers(n) + (1 << 40), counter, 7
        )
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
        angle = 2 * torch.pi * u[:, 1:3]
        offset = distance[:, None] * torch.stack((angle[:, 0].cos(), angle[:, 0].sin()), 1)
        yaw = torch.stack((angle[:, 1].cos(), angle[:, 1].sin()), dim=1)
        anywhere = root[:, :2] + offset
        if library.box is not None:
            return self._with_box(index, imaginary, anywhere, yaw, u[:, 3])
        point = torch.where(imaginary[:, None], anywhere, library.seat[index, :2])
        facing = torch.where(imaginary[:, None], yaw, library.facing[index])
        place = torch.cat((point, torch.zeros_like(point[:, :1])), dim=1)

        def state(frames: Tensor) -> Tensor:
            own, at = library.body.features[frames], library.qpos[frames, :3]
            if library.affordance == "lie":
                own, at = self._raised(own, at, u[:, 3])
            around = features.object_features(at, library.body.heading[frames], place, facing)
            return torch.cat((own, around), dim=1)

        return state(index), state(index + 1)

    def _raised(self, own: Tensor, root: Tensor, u: Tensor) -> tuple[Tensor, Tensor]:
        """Own features [n, 105] and roots [n, 3] of who lies or sits on a bed, on a higher one."""
        low, high = self._mixture.raised_m
        down = ((_STANDS_M - root[:, 2:]) / 0.15).clamp(0.0, 1.0)
        up = down * (low + (high - low) * u[:, None])
        height = features.STATE.slice("root_height")
        assert height == slice(0, 1)
        return torch.cat((own[:, :1] + up, own[:, 1:]), dim=1), torch.cat(
            (root[:, :2], root[:, 2:] + up), dim=1
        )

    def _with_box(
        self, index: Tensor, imaginary: Tensor, anywhere: Tensor, yaw: Tensor, u: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Transitions with the box as the clip has it, or an imaginary one on a stand at
        `anywhere` [n, 2] with the yaw [n, 2] (cosine, sine)."""
        library = self._library
        box = library.box
        assert box is not None
        low, high = self._mixture.box_height_m
        height = low + (high - low) * u[:, None]
        there = torch.cat((anywhere, height), dim=1)
        turned = rotations.from_heading(yaw)

        def state(frames: Tensor) -> Tensor:
            position = torch.where(imaginary[:, None], there, box.position[frames])
            rotation = torch.where(imaginary[:, None], turned, box.rotation[frames])
            around = features.posed_object_features(
                library.qpos[frames, :3], library.body.heading[frames], position, rotation
            )
            return torch.cat((library.body.features[frames], around), dim=1)

        return state(index), state(index + 1)


def prepare(clip: Clip, task: str = "sit") -> list[Clip]:
    """A raw clip made ready for a task: 30 Hz, on the floor, cut so that each part uses one object.

    A clip that brings its object along is ready as it is.
    """
    if clip.seat is None and clip.bed is None and clip.box is None:
        clip = ground.floor_mended(ground.resampled(clip))
    return ground.with_objects(clip, task)

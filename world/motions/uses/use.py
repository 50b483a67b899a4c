"""What a task learns of clips: which object they use, frame by frame, and what a discriminator is
shown of it. Each way to use a clip is a file beside this one."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol

import torch
from torch import Tensor

from world.character import features
from world.character.features import Body
from world.motions.clip import Clip
from world.motions.fit.objects import grounded, known
from world.motions.mixture import StyleMixture
from world.scene.target import Target

#: Stages of use: approach or leave; sit or lie down, get up, pick up, put down; seated, lying,
#: carrying.
APPROACH, TRANSITION, CONTACT = 0, 1, 2
#: Done with it for good: no stage to start at.
EXCLUDED = -1
#: Pelvis height from which a frame counts as upright, m.
UPRIGHT_M = 0.72


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
    """[T] int64: APPROACH, TRANSITION, CONTACT, or EXCLUDED."""
    box: BoxFrames
    kept: Tensor
    """[T] bool: frames to learn from; where a clip does what the task never does, False."""


class FrameTable(Protocol):
    """All F frames of a library's clips."""

    qpos: Tensor
    """[F, 43]."""
    body: Body
    """Of the F."""
    seat: Tensor
    """[F, 3]."""
    facing: Tensor
    """[F, 2]."""
    box: BoxFrames | None


@dataclass(frozen=True)
class TransitionBatch:
    """Transitions batch for the discriminator, and numbers to place their objects by."""

    index: Tensor
    """[n]: the first frame of each."""
    relocated: Tensor
    """[n] bool: the object is anywhere, instead of where the clip has it."""
    anywhere: Tensor
    """[n, 2]: where such an object is, clip's world, m."""
    yaw: Tensor
    """[n, 2]: how it is turned, cosine and sine."""
    u: Tensor
    """[n]: another uniform number."""


class ClipUse(ABC):
    """A way to use clips; the record holds no state."""

    kind: ClassVar[str] = ""
    """The field of a clip that holds the object used; none: the task needs no object."""
    missing: ClassVar[str]
    """What to do where episodes are to start from clips and none is of use."""
    idle_every: ClassVar[int] = 12
    """Of upright frames that stand idle one in so many is kept: people wait a lot before and after
    they sit, and a discriminator that has seen it rewards a character for standing where it is."""

    def accepts(self, clip: Clip) -> bool:
        """Whether the objects that a clip knows are this task's; yes where it knows none."""
        return not self.kind or not known(clip) or getattr(clip, self.kind) is not None

    def prepare(self, clip: Clip) -> list[Clip]:
        """A raw clip made ready: 30 Hz, on the floor, cut so that each part uses one object. A clip
        that brings another task's objects is left out."""
        if known(clip):
            return [clip] if self.accepts(clip) else []
        return self.fit(grounded(clip))

    @abstractmethod
    def fit(self, clip: Clip) -> list[Clip]:
        """The parts of a floor-mended clip, with the objects that this task uses in them."""

    @abstractmethod
    def read(self, clip: Clip) -> Use:
        """What the clip uses."""

    @abstractmethod
    def transitions(
        self, table: FrameTable, batch: TransitionBatch, mixture: StyleMixture
    ) -> tuple[Tensor, Tensor]:
        """Mocap transitions (s, s') [n, 114] each, with the object that each state needs."""

    @abstractmethod
    def with_object(self, clip: Clip, target: Target, run: tuple[int, int]) -> Clip:
        """A clip that a policy made, with the object that it used in the frames `run` (first, one
        beyond the last), which is where `target` [1] says."""

    def boxes(self, uses: Sequence[Use]) -> BoxFrames | None:
        """The boxes of the clips, joined; None where none are carried."""
        return None

    def unfit(self, table: FrameTable) -> Tensor:
        """[F] bool: frames that no episode may start from."""
        return torch.zeros(len(table.qpos), dtype=torch.bool)


class StandingObjectUse(ClipUse):
    """Of an upright object at a place on the floor."""

    def transitions(
        self, table: FrameTable, batch: TransitionBatch, mixture: StyleMixture
    ) -> tuple[Tensor, Tensor]:
        """See ClipUse."""
        index, relocated = batch.index, batch.relocated[:, None]
        point = torch.where(relocated, batch.anywhere, table.seat[index, :2])
        facing = torch.where(relocated, batch.yaw, table.facing[index])
        place = torch.cat((point, torch.zeros_like(point[:, :1])), dim=1)

        def state(frames: Tensor) -> Tensor:
            own, at = self.raised(
                table.body.features[frames], table.qpos[frames, :3], batch.u, mixture
            )
            around = features.object_features(at, table.body.heading[frames], place, facing)
            return torch.cat((own, around), dim=1)

        return state(index), state(index + 1)

    def raised(
        self, own: Tensor, root: Tensor, u: Tensor, mixture: StyleMixture
    ) -> tuple[Tensor, Tensor]:
        """Own features [n, 105] and roots [n, 3] at another height of the object; as they are."""
        return own, root


def use_at(
    clip: Clip,
    point: tuple[float, ...] | None,
    head: tuple[float, ...] | None,
    facing_rad: float,
    stage: Tensor,
) -> Use:
    """The use of one place through a whole clip; nothing is used where `point` is None."""

    def rows(values: tuple[float, ...] | None) -> Tensor:
        return torch.tensor(values or (0.0, 0.0, 0.0), dtype=torch.float32).expand(clip.frames, -1)

    yaw = torch.tensor(facing_rad)
    facing = torch.stack((torch.cos(yaw), torch.sin(yaw))).to(torch.float32)
    facing = facing.expand(clip.frames, -1)
    kept = torch.ones(clip.frames, dtype=torch.bool)
    box = no_box(clip.frames)
    return Use(point is not None, rows(point), rows(head), facing, stage, box, kept)


def no_box(frames: int) -> BoxFrames:
    """No box in any frame."""
    upright = torch.tensor([1.0, 0.0, 0.0, 0.0]).expand(frames, -1)
    nothing, never = torch.zeros(frames, 3), torch.zeros(frames, dtype=torch.bool)
    nowhere = torch.zeros(frames, 4)
    return BoxFrames(
        nothing, upright, nothing, nothing, nothing, never, nowhere, nowhere, never, never
    )

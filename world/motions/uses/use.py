"""Uses of clips: the object of each frame, and the windows for the discriminator. Each use is a
file beside this one."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol

import torch
from torch import Tensor

from world.character import features
from world.character.features import Body
from world.motions.clip import Clip
from world.motions.fit.objects import annotated, grounded
from world.motions.mixture import StyleMixture
from world.scene.target import Target

#: Stages: approach or leave; sit or lie down, get up, pick up, put down; seated, lying, carrying.
APPROACH, TRANSITION, CONTACT = 0, 1, 2
#: Stage of frames that are excluded from reference states.
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
    """[F, 4]: initial position: centre (m) and yaw (rad)."""
    put: Tensor
    """[F, 4]: final position, likewise."""
    has_put: Tensor
    """[F] bool: the clip shows the box being put down."""
    has_picked: Tensor
    """[F] bool: the clip shows the box being picked up; else it begins in hand."""


@dataclass(frozen=True)
class Use:
    """The object that a clip of T frames uses."""

    has_object: bool
    """Whether the clip has the object of the task; else all is 0."""
    point: Tensor
    """[T, 3]: use point, clip's world, m."""
    head: Tensor
    """[T, 3]: point below the head, m."""
    facing: Tensor
    """[T, 2]: cosine and sine of the facing."""
    stage: Tensor
    """[T] int64: APPROACH, TRANSITION, CONTACT, or EXCLUDED."""
    box: BoxFrames
    kept: Tensor
    """[T] bool: frames for training; False where a clip does what the task never does."""


class FrameTable(Protocol):
    """All F frames of a library's clips; see MotionLibrary."""

    qpos: Tensor
    """[F, 43]."""
    body: Body
    """Features and poses."""
    seat: Tensor
    """[F, 3]: use points, m."""
    facing: Tensor
    """[F, 2]: cosine and sine of the facings."""
    box: BoxFrames | None


@dataclass(frozen=True)
class WindowBatch:
    """n windows for the discriminator, with random numbers for the poses of their objects."""

    index: Tensor
    """[n]: the last frame but one of each."""
    relocated: Tensor
    """[n] bool: the object is at a random pose instead of the clip's."""
    anywhere: Tensor
    """[n, 2]: position of a relocated object, clip's world, m."""
    yaw: Tensor
    """[n, 2]: cosine and sine of its yaw."""
    u: Tensor
    """[n]: another uniform number."""


class ClipUse(ABC):
    """A use of clips; the record has no state."""

    kind: ClassVar[str] = ""
    """The field of a clip that holds the object used; empty: none."""
    holds: ClassVar[bool] = False
    """Whether the object is held in the hands."""
    lacking: ClassVar[str]
    """What is wrong with clips of which none has this use."""
    wanted: ClassVar[str]
    """Clips that have it."""
    idle_every: ClassVar[int] = 12
    """One in so many of the idle upright frames is kept: people often stand still before and after
    they sit, and a discriminator trained on that rewards the policy for standing still."""

    @property
    def none(self) -> str:
        """Error message where no clip is left for this use."""
        return f"{self.lacking}: --motions must name {self.wanted}"

    @property
    def missing(self) -> str:
        """Error message where reference states are configured and no clip has this use."""
        return f"{self.lacking}: set --world.initial.reference to 0 or add {self.wanted}"

    def accepts(self, clip: Clip) -> bool:
        """Whether the annotated objects of a clip are this use's; True without annotation."""
        return not self.kind or not annotated(clip) or getattr(clip, self.kind) is not None

    def prepare(self, clip: Clip) -> list[Clip]:
        """The parts of a raw clip at 30 Hz, on the floor, each with one object; empty for a clip
        that is annotated with another use's objects."""
        if annotated(clip):
            return [clip] if self.accepts(clip) else []
        return self.fit(grounded(clip))

    @abstractmethod
    def fit(self, clip: Clip) -> list[Clip]:
        """The parts of a floor-corrected clip, with the objects of this use."""

    @abstractmethod
    def read(self, clip: Clip) -> Use:
        """The use of a clip."""

    @abstractmethod
    def windows(
        self, table: FrameTable, batch: WindowBatch, mixture: StyleMixture, frames: int = 2
    ) -> tuple[Tensor, ...]:
        """Windows of `frames` mocap states, oldest first, [n, 114] each, with the features of their
        objects; the last but one is the state at `batch.index`."""

    @abstractmethod
    def with_object(self, clip: Clip, target: Target, run: tuple[int, int]) -> Clip:
        """A clip of a policy, annotated with the object at `target` [1], which it uses in the
        frames `run` (first, one beyond the last)."""

    def boxes(self, uses: Sequence[Use]) -> BoxFrames | None:
        """The boxes of the clips, concatenated; None where this use has no boxes."""
        return None

    def unfit(self, table: FrameTable) -> Tensor:
        """[F] bool: frames that must not be reference states."""
        return torch.zeros(len(table.qpos), dtype=torch.bool)


class StandingObjectUse(ClipUse):
    """The use of an upright object that stands on the floor."""

    def windows(
        self, table: FrameTable, batch: WindowBatch, mixture: StyleMixture, frames: int = 2
    ) -> tuple[Tensor, ...]:
        """See ClipUse."""
        index, relocated = batch.index, batch.relocated[:, None]
        point = torch.where(relocated, batch.anywhere, table.seat[index, :2])
        facing = torch.where(relocated, batch.yaw, table.facing[index])
        position = torch.cat((point, torch.zeros_like(point[:, :1])), dim=1)

        def state(frames: Tensor) -> Tensor:
            own, at = self.raised(
                table.body.features[frames], table.qpos[frames, :3], batch.u, mixture
            )
            around = features.object_features(at, table.body.heading[frames], position, facing)
            return torch.cat((own, around), dim=1)

        return tuple(state(index + k) for k in range(2 - frames, 2))

    def raised(
        self, own: Tensor, root: Tensor, u: Tensor, mixture: StyleMixture
    ) -> tuple[Tensor, Tensor]:
        """Own features [n, 105] and roots [n, 3] with the object at another height; by default
        unchanged."""
        return own, root


def use_at(
    clip: Clip,
    point: tuple[float, ...] | None,
    head: tuple[float, ...] | None,
    facing_rad: float,
    stage: Tensor,
) -> Use:
    """The use of one point in all frames of a clip; no object where `point` is None."""

    def rows(values: tuple[float, ...] | None) -> Tensor:
        return torch.tensor(values or (0.0, 0.0, 0.0), dtype=torch.float32).expand(clip.frames, -1)

    yaw = torch.tensor(facing_rad)
    facing = torch.stack((torch.cos(yaw), torch.sin(yaw))).to(torch.float32)
    facing = facing.expand(clip.frames, -1)
    kept = torch.ones(clip.frames, dtype=torch.bool)
    box = no_box(clip.frames)
    return Use(point is not None, rows(point), rows(head), facing, stage, box, kept)


def no_box(frames: int) -> BoxFrames:
    """BoxFrames of `frames` frames without a box."""
    upright = torch.tensor([1.0, 0.0, 0.0, 0.0]).expand(frames, -1)
    nothing, never = torch.zeros(frames, 3), torch.zeros(frames, dtype=torch.bool)
    nowhere = torch.zeros(frames, 4)
    return BoxFrames(
        nothing, upright, nothing, nothing, nothing, never, nowhere, nowhere, never, never
    )

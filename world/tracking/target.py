"""The target of tracking: a reference motion with its present frame, and deviations from it."""

from dataclasses import dataclass, field, fields
from typing import Any

import torch
from torch import Tensor

from world import rotations
from world.character import features
from world.character.features import Body
from world.character.model import BODIES
from world.scene.target import BoxState, Target
from world.tracking.reference import Reference

HANDS = [BODIES.index("right_hand"), BODIES.index("left_hand")]
#: Radius of a hand, and the greatest gap that counts as contact, m.
HAND_M, TOUCH_M = 0.04, 0.02


@dataclass(frozen=True)
class TrackTarget(Target):
    """The reference motions of n scenes, and the present frame of each."""

    reference: Reference = field(kw_only=True)
    residual: bool = field(kw_only=True)
    """Actions are added to the reference's set-points; false: to the neutral ones."""
    frame: Tensor = field(kw_only=True)
    """[n] int64: the present frame of the reference."""
    origin: Tensor = field(kw_only=True)
    """[n, 3]: from the clips' worlds to the scenes', m."""
    lost: Tensor = field(kw_only=True)
    """[n] int64: number of control steps since the grip was lost."""
    mass: Tensor = field(kw_only=True)
    """[n]: of the box, kg."""

    def rows(self, ids: Tensor) -> "TrackTarget":
        mine: dict[str, Any] = {name: value[ids] for name, value in self._own().items()}
        base = super().rows(ids)
        common: dict[str, Any] = {f.name: getattr(base, f.name) for f in fields(Target)}
        return TrackTarget(**common, reference=self.reference, residual=self.residual, **mine)

    def tensors(self) -> dict[str, Tensor]:
        return super().tensors() | self._own()

    def _own(self) -> dict[str, Tensor]:
        return {
            "frame": self.frame,
            "origin": self.origin,
            "lost": self.lost,
            "mass": self.mass,
        }

    def set_points(self) -> Tensor | None:
        """See Target: those of the reference's next frame."""
        return self.reference_set_points() if self.residual else None

    def reference_set_points(self) -> Tensor:
        """[n, 28]: set-points of the reference's next frame, rad."""
        return self.reference.set_point[self.reference.ahead(self.frame, 1)]

    def advance(self, body: Body) -> None:
        self.frame.copy_(self.reference.ahead(self.frame, 1))
        missing = self.holds() & ~touching(body, self).all(dim=1)
        self.lost.copy_(torch.where(missing, self.lost + 1, 0))

    def episode_records(self) -> dict[str, Tensor]:
        return {"segment": self.reference.segment[self.frame]}

    def completed(self) -> Tensor:
        return self.frame >= self.reference.stop[self.clip()] - 1

    def clip(self) -> Tensor:
        """[n] int64: the clip of each scene."""
        return self.reference.clip[self.frame]

    def boxed(self) -> Tensor:
        """[n] bool: the clip has a box."""
        return self.reference.boxed[self.clip()]

    def holds(self) -> Tensor:
        """[n] bool: the reference holds the box in its present frame."""
        return self.reference.held[self.frame]

    def object_features(self, body: Body) -> Tensor:
        around = features.object_features(body.root, body.heading, self.floor_point(), self.facing)
        if self.box is None:
            return around
        posed = super().object_features(body)
        return torch.where(self.boxed()[:, None], posed, around)


@dataclass(frozen=True)
class Deviation:
    """Deviations of n scenes from their references, m."""

    body: Tensor
    """[n]: rms over the bodies of their positions relative to the root, world axes."""
    root: Tensor
    """[n]: of the root, horizontally."""
    height: Tensor
    """[n]: of its height."""
    box: Tensor
    """[n]: of the box from its reference: in the world, or relative to the root where that is less
    and the reference holds it; 0 without a box."""


def deviation(body: Body, target: TrackTarget) -> Deviation:
    """Return the current deviations of the scenes from their references."""
    reference, frame = target.reference, target.frame
    theirs = reference.position[frame]
    relative = (body.position - body.root[:, None]) - (theirs - theirs[:, :1])
    squared = relative[:, 1:].square().sum(dim=2).mean(dim=1)
    root = theirs[:, 0] + target.origin - body.root
    box = torch.zeros_like(squared)
    if target.box is not None:
        there = reference.box[frame, :3] + target.origin
        off = target.box.position - there
        # one that is held lags with the root; one that is just gripped is still where it was
        carried = torch.where(target.holds(), (off + root).norm(dim=1), torch.inf)
        box = torch.where(target.boxed(), torch.minimum(off.norm(dim=1), carried), 0.0)
    return Deviation(squared.sqrt(), root[:, :2].norm(dim=1), root[:, 2].abs(), box)


def touching(body: Body, target: Target) -> Tensor:
    """[n, 2] bool: whether the right and the left hand touch the box."""
    if target.box is None:
        return torch.zeros(len(body.root), 2, dtype=torch.bool)
    return gap_m(body, target.box) < TOUCH_M


def gap_m(body: Body, box: BoxState) -> Tensor:
    """[n, 2]: from each hand's surface to the box's, m; negative within."""
    beyond = _in_box(body, box).abs() - box.half[:, None]
    distance = beyond.clamp_min(0.0).norm(dim=2) + beyond.amax(dim=2).clamp_max(0.0)
    return distance - HAND_M


def _in_box(body: Body, box: BoxState) -> Tensor:
    """[n, 2, 3]: both hands' centres in the box's own axes, from its centre, m."""
    offset = body.position[:, HANDS] - box.position[:, None]
    return (offset[..., None] * rotations.matrix(box.rotation)[:, None]).sum(dim=-2)


def tracked(target: Target) -> TrackTarget:
    """Return `target` as a TrackTarget; AssertionError if it has no reference."""
    assert isinstance(target, TrackTarget), "tracking needs a reference"
    return target

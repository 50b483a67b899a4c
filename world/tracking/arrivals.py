"""States in which a policy that walks has come up to a box, as initial states of tracking.

In a clip that takes a box up from standing a person stands still and square before it. A policy
that walks there comes turned, aside, and with speed left (pretrained/walk: 0.26 rad, 0.07 m,
0.36 m/s): a tracker that has never begun so falls, where a task is made of walking and tracking.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from world import rotations
from world.tracking.reference import Reference

#: A pick-up is followed from so many frames before the grip at most, and only where the person
#: stands by then: slower than this, m/s.
_BEFORE, _STANDS_M_S = 70, 0.15
#: Who has moved no body by more than this, m, still stands.
_WAITS_M = 0.08
#: The frame of a start is at most so many before the last one in which the person stands, in which
#: to stop and to turn, and so many after it.
_EARLY, _LATE = 25, 3
#: Greatest displacement of a state, m, so that few states make many.
_SPREAD_M = 0.05
#: Fraction of the starts before such a grip that are arrivals.
_SHARE = 0.6
_QUARTER = 0.5 * torch.pi


@dataclass(frozen=True)
class Arrivals:
    """A states, seen from the box: the origin is on the floor below the middle of its nearest face,
    the x axis goes into it."""

    qpos: Tensor
    """[A, 43]."""
    qvel: Tensor
    """[A, 34]."""


def seen_from(qpos: Tensor, qvel: Tensor, face: Tensor, into: Tensor) -> Arrivals:
    """Return states qpos [n, 43] and qvel [n, 34] as they are seen from floor points face [n, 2],
    m, with x axes into [n, 2], unit vectors."""
    here = qpos.clone()
    here[:, :2] -= face
    back = into * into.new_tensor((1.0, -1.0))
    return Arrivals(*_turned(here, qvel, back))


@dataclass(frozen=True)
class PickUps:
    """Where the clips of a reference take a box up from standing."""

    grip: Tensor
    """[C] int64: the frame of the grip; -1: the clip has none such."""
    stands: Tensor
    """[C] int64: the last frame before it in which the person stands; -1 likewise."""
    face: Tensor
    """[C, 2]: floor point below the middle of the face that the person stands before, m."""
    into: Tensor
    """[C, 2]: unit vector from there into the box."""

    @staticmethod
    def of(reference: Reference) -> "PickUps":
        """Return those of a reference."""
        grip = torch.full((reference.clips,), -1)
        stands = grip.clone()
        for clip in torch.nonzero(reference.boxed & reference.has_picked).flatten().tolist():
            first, stop = int(reference.first[clip]), int(reference.stop[clip])
            held = torch.nonzero(reference.held[first:stop]).flatten()
            if not len(held) or int(held[0]) == 0:
                continue
            at = first + int(held[0])
            low = max(first, at - _BEFORE)
            if float(reference.qvel[low, :2].norm()) >= _STANDS_M_S:
                continue
            moved = (reference.position[low:at] - reference.position[low]).norm(dim=2)
            still = torch.nonzero(moved.amax(dim=1) < _WAITS_M).flatten()
            grip[clip], stands[clip] = at, low + int(still[-1])
        centre, yaw = reference.picked[:, :2], reference.picked[:, 3]
        facing = rotations.yaw(reference.heading[grip.clamp_min(0)])
        turns = torch.round((facing - yaw) / _QUARTER)
        into = rotations.cos_sin(yaw + turns * _QUARTER)
        deep = torch.where(turns.long() % 2 == 0, reference.size[:, 0], reference.size[:, 1])
        return PickUps(grip, stands, centre - 0.5 * deep[:, None] * into, into)

    def chosen(self, clip: Tensor, frame: Tensor, u: Tensor) -> Tensor:
        """Return the rows of m starts that are to be arrivals: at frames [m] of clips [m] shortly
        before the grip, a share of them by u [m] in [0, 1)."""
        grip = self.grip[clip]
        before = (grip >= 0) & (frame < grip) & (frame >= grip - _BEFORE)
        return torch.nonzero(before & (u < _SHARE)).flatten()

    def frames(self, clip: Tensor, first: Tensor, u: Tensor) -> Tensor:
        """Return the frames [m] at which arrivals join clips [m] that begin at first [m], by u
        [m]."""
        apart = (u * (_EARLY + _LATE + 1)).long() - _EARLY
        return (self.stands[clip] + apart).maximum(first)

    def laid(self, arrivals: Arrivals, clip: Tensor, origin: Tensor, u: Tensor) -> Arrivals:
        """Return arrivals [m] in the scenes of clips [m] with origins [m, 3], by u [m, 3]."""
        number = (u[:, 0] * len(arrivals.qpos)).long().clamp_max(len(arrivals.qpos) - 1)
        seen, qvel = arrivals.qpos[number].clone(), arrivals.qvel[number]
        seen[:, :2] += 2.0 * _SPREAD_M * (u[:, 1:] - 0.5)
        qpos, qvel = _turned(seen, qvel, self.into[clip])
        qpos[:, :2] += self.face[clip] + origin[:, :2]
        return Arrivals(qpos, qvel)


def _turned(qpos: Tensor, qvel: Tensor, by: Tensor) -> tuple[Tensor, Tensor]:
    """States turned about the vertical by `by` [n, 2] (cosine, sine)."""
    qpos, qvel = qpos.clone(), qvel.clone()
    qpos[:, :2] = rotations.turn(by, qpos[:, :2])
    qpos[:, 3:7] = rotations.multiply(rotations.from_heading(by), qpos[:, 3:7])
    # the root's linear velocity is the world's, the angular one its own
    qvel[:, :2] = rotations.turn(by, qvel[:, :2])
    return qpos, qvel

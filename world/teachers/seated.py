"""A tracking policy as the teacher of sitting down, wherever the seat stands.

Of the clips in which someone sits down, the one with a seat like the scene's and a frame like the
state is laid over the scene so that both seats coincide, and the tracker follows it from the
character's own state. What it would do is the label. The reference is hidden from the student,
which sees the seat. On the way to the seat a walker labels.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from world import rotations
from world.character.features import Body
from world.character.model import NU
from world.errors import ClipError
from world.motions.clip import Clip
from world.scene.batch import Scenes
from world.scene.target import Target
from world.teachers.laid import KEYS, LOST_M2, advanced, followed, level, turned
from world.teachers.tracker import Act, labels
from world.teachers.walker import WalkerTeacher
from world.tracking.reference import Reference, reference
from world.tracking.target import TrackTarget

#: Frames of a clip that are followed: so many before the person sits, at most, and after it.
_BEFORE, _AFTER = 60, 45
#: A person whose root is above this fraction of its greatest height still stands.
_UPRIGHT = 0.97
#: Frames before the root begins to sink that are followed too: in more of them the person waits,
#: and a student that does not see the reference would learn to wait.
_LEAD = 6
#: Weights of the key bodies where a state is compared with a frame.
_WEIGHT = torch.tensor([1.0, 1.0, 1.0, 0.3, 0.3, 1.0, 1.0])
#: Cost of a metre between the heights of both seats, where one of misplaced feet is 1.
_HEIGHT_COST = 4.0
#: The scene follows no clip.
_FREE = -1


@dataclass(frozen=True)
class _Sittings:
    """C clips in which someone sits down."""

    reference: Reference
    low: Tensor
    """[C] int64: the first frame that is followed."""
    high: Tensor
    """[C] int64: the last."""
    point: Tensor
    """[C, 3]: the seat's point, the clip's world, m."""
    facing: Tensor
    """[C, 2]: cosine and sine of the seat's facing there."""


class SeatedTracker:
    """Labels scenes of sit: the way to the seat by a walker, sitting down by a tracker on the
    clips; a world.teachers.teacher.Teacher."""

    def __init__(
        self,
        act: Act,
        residual: bool,
        clips: Sequence[Clip],
        scenes: int,
        walker: WalkerTeacher | None = None,
    ) -> None:
        """act, residual: see TrackerTeacher. clips: those in which someone sits down are used.

        Raises ClipError where there is none.
        """
        self._act, self._residual = act, residual
        self._walker, self._sittings = walker, _sittings(clips)
        self._clip = torch.full((scenes,), _FREE)
        self._frame = torch.zeros(scenes, dtype=torch.int64)

    def reset(self, rows: Tensor, target: Target) -> None:
        """Forget the clips that these scenes followed."""
        self._clip[rows], self._frame[rows] = _FREE, 0
        if self._walker is not None:
            self._walker.reset(rows, target)

    def label(self, scenes: Scenes, target: Target, variant: Tensor, clock: int) -> Tensor:
        """Teacher actions [n, 28] float32, in the student's units; NaN far from all clips."""
        if self._walker is None:
            found = torch.full((len(self._clip), NU), torch.nan)
        else:
            found = self._walker.label(scenes, target, variant, clock)
        over = found.isnan().any(dim=1)
        self._clip[~over] = _FREE
        rows = torch.nonzero(over).flatten()
        if len(rows):
            found[rows] = self._follow(scenes, rows, target.rows(rows))
        return found

    def _follow(self, scenes: Scenes, rows: Tensor, target: Target) -> Tensor:
        """Labels [m, 28] of the scenes `rows`, and their next frames."""
        known = self._sittings
        free = torch.nonzero(self._clip[rows] == _FREE).flatten()
        if len(free):
            self._clip[rows[free]] = self._best(scenes, rows[free], target.rows(free))
            self._frame[rows[free]] = -1
        clip = self._clip[rows]
        laid = _lay(scenes, rows, target, known, clip)
        frames = self._frames(clip)
        distance = self._distance(laid, frames)
        frame = advanced(self._frame[rows], distance, frames)
        self._frame[rows] = frame
        there = TrackTarget(
            laid.point, known.facing[clip], laid.corners, laid.point,
            reference=known.reference, residual=self._residual, frame=frame, origin=laid.origin,
            lost=torch.zeros_like(frame), mass=torch.zeros(len(rows)),
        )  # fmt: skip
        label = labels(self._act, self._residual, scenes, laid.body, there)
        lost = distance.amin(dim=1) > LOST_M2
        return torch.where(lost[:, None], torch.nan, label)

    def _best(self, scenes: Scenes, rows: Tensor, target: Target) -> Tensor:
        """[m] int64: the clips with a seat as high as the scene's, some frame of which is nearest
        to the state."""
        cost = []
        for number in range(len(self._sittings.low)):
            clip = torch.full_like(rows, number)
            laid = _lay(scenes, rows, target, self._sittings, clip)
            least = self._distance(laid, self._frames(clip)).amin(dim=1)
            height = (target.point[:, 2] - self._sittings.point[number, 2]).abs()
            cost.append(least + _HEIGHT_COST * height)
        return torch.stack(cost, dim=1).argmin(dim=1)

    def _frames(self, clip: Tensor) -> Tensor:
        """[m, F] int64: the frames that are followed of these clips, the last one repeated."""
        known = self._sittings
        return followed(known.low[clip], known.high[clip], _BEFORE + _AFTER + _LEAD + 1)

    def _distance(self, laid: "_Laid", frames: Tensor) -> Tensor:
        """[m, F]: of the key bodies from these frames, squared, weighted and summed, m²."""
        here = laid.body.position[:, KEYS] - laid.origin[:, None]
        away = here[:, None] - self._sittings.reference.position[frames][:, :, KEYS]
        return (away.square().sum(dim=3) * _WEIGHT).sum(dim=2)

    def state_dict(self) -> dict[str, Tensor]:
        """Which clips the scenes follow, and where in them."""
        return {"clip": self._clip, "frame": self._frame}

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Restore what `state_dict` gave."""
        for name, value in self.state_dict().items():
            value.copy_(state[name])


@dataclass(frozen=True)
class _Laid:
    """m scenes in the axes of a clip each, the seats' facings alike."""

    body: Body
    point: Tensor
    """[m, 3]: the scene's seat, m."""
    corners: Tensor
    """[m, 8, 3]: its corners, m."""
    origin: Tensor
    """[m, 3]: from the clip's world to the scene's, so that both seats coincide, m."""


def _lay(scenes: Scenes, rows: Tensor, target: Target, known: _Sittings, clip: Tensor) -> _Laid:
    """Turn the scenes `rows`, whose targets these are, as the clips [m] stand."""
    turn = rotations.yaw(known.facing[clip]) - rotations.yaw(target.facing)
    back = rotations.cos_sin(turn)
    point = level(back, target.point)
    origin = point - known.point[clip]
    origin[:, 2] = 0.0  # both stand on the floor
    corners = level(back[:, None], target.corners)
    return _Laid(turned(scenes, rows, back), point, corners, origin)


def _sittings(clips: Sequence[Clip]) -> _Sittings:
    """Return the clips in which someone sits down on a seat from standing."""
    used = [clip for clip in clips if clip.seat is not None]
    if not used:
        raise ClipError(
            "no clip in which someone sits down: a tracker cannot teach sit by these clips"
        )
    known = reference(used, starts=False)
    low, high, point, facing = [], [], [], []
    for number, clip in enumerate(used):
        assert clip.seat is not None
        first, stop = int(known.first[number]), int(known.stop[number])
        seated = first + clip.seat.from_frame
        height = known.position[first:seated, 0, 2]
        upright = torch.nonzero(height > _UPRIGHT * height.max()) if len(height) else []
        begin = first + int(upright[-1]) - _LEAD if len(upright) else seated
        low.append(max(first, seated - _BEFORE, begin))
        high.append(min(stop - 1, first + clip.seat.to_frame - 1, seated + _AFTER))
        point.append(clip.seat.point_m)
        facing.append(clip.seat.facing_rad)
    return _Sittings(
        known,
        torch.tensor(low),
        torch.tensor(high),
        torch.tensor(point, dtype=torch.float32),
        rotations.cos_sin(torch.tensor(facing, dtype=torch.float32)),
    )

"""A tracking policy as the teacher of picking a box up and of putting it down, wherever it stands.
Policies that walk label the ways to the box and with it.

A clip shows how people take one box from one place. Variants of the clip with other boxes and
stands are made; the one that fits is laid over the scene so that both boxes coincide, and the
tracker follows it from the character's own state. What it would do is the label. The reference is
hidden from the student, which sees the box and the target. (OmniRetarget and ResMimic adapt their
references to the scene too, before training; here it is done while the student drives.)
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from world import rotations
from world.character.features import Body
from world.character.model import NU
from world.errors import ClipError
from world.motions.clip import Clip
from world.motions.variants import variant
from world.scene.batch import Scenes
from world.scene.target import BoxState, Target
from world.tasks.carry import grips
from world.teachers.boxes import (
    QUARTER,
    Boxes,
    half_turned,
    misfit,
    originals,
    quarter_turns,
    sizes,
)
from world.teachers.carrying import CarryingWalker
from world.teachers.laid import KEYS, LOST_M2, advanced, followed, level, turned
from world.teachers.tracker import Act, labels
from world.teachers.walker import FACES, WalkerTeacher, taken
from world.tracking.reference import Reference, reference
from world.tracking.target import TrackTarget

#: Step of the stands that have variants of their own, m.
_STANDS_M = 0.1
#: Frames of a variant that are followed: so many before the grip or the release, and after it.
_BEFORE, _AFTER = 70, 40
#: In the first of these the person stands: slower than this, m/s. A clip that is still walking
#: there cannot be laid over a character that has just arrived.
_STANDS_M_S = 0.15
#: Who has moved no key body by more than this, m, waits.
_WAITS_M = 0.08
#: A box is raised when all key bodies are within this of where they stay, m, but at least so many
#: frames after the grip: from a high stand it rises by a few centimetres.
_RAISED_M, _LIFTS = 0.03, 12
#: Weights of the key bodies where a state is compared with a frame.
_WEIGHT = torch.tensor([1.0, 1.0, 1.0, 1.0, 1.0, 1.5, 1.5])
#: Weight of the box's squared displacement in this comparison.
_BOX_WEIGHT = 8.0
#: Cost of a metre of the stand's height in a fit; a metre of misplaced pelvis costs 1.
_STAND_COST = 4.0
#: A pick-up begins, and goes on, while the pelvis is within these of the clip's, m, and the first
#: while it is slower than this, m/s.
_BEGINS_M, _LEAVES_M, _SLOW_M_S = 0.25, 0.8, 0.3
#: It is over for one who has turned from the clip's heading before the grip, with this cosine.
#: Turned by 0.5 rad the tracker grips half of the boxes, by 1 rad an eighth.
_TURNS_AWAY = 0.87
#: Putting down begins with the box this near to its target, m, by one who is slower than this, m/s.
_PUTS_M, _ARRIVES_M_S = 0.45, 0.5
#: Stages of a scene.
_FREE, _PICKING, _PUTTING = 0, 1, 2


@dataclass(frozen=True)
class _Variants:
    """V variants of one kind of handling."""

    reference: Reference
    keys: Tensor
    """[F, K, 3]: positions of the key bodies, the pelvis first, m."""
    low: Tensor
    """[V] int64: the first frame that is followed."""
    high: Tensor
    """[V] int64: the last."""
    anchor: Tensor
    """[V, 4]: where the box is picked up or put down: centre, m, and yaw, rad."""
    grip: Tensor
    """[V] int64: the frame of the grip or release."""
    facing: Tensor
    """[V, 2]: heading (cosine, sine) in that frame."""
    half: Tensor
    """[V, 3]: half edges of the box, m."""
    stand: Tensor
    """[V]: height of the stand, m."""


class AlignedTracker:
    """Labels scenes of carry: the way to the box by a walker, picking up and putting down by a
    tracker on variants of the clips; a world.teachers.teacher.Teacher."""

    def __init__(
        self,
        act: Act,
        residual: bool,
        clips: Sequence[Clip],
        bank: Boxes,
        stands_m: tuple[float, float],
        scenes: int,
        walker: WalkerTeacher | None = None,
        carrying: CarryingWalker | None = None,
    ) -> None:
        """act, residual: see TrackerTeacher. clips: those with a box are used. stands_m: lowest and
        highest stand of the scenes. walker, carrying: label the ways to the box and with it.

        Raises ClipError where no clip picks a box up from standing still.
        """
        self._act, self._residual = act, residual
        self._walker, self._carrying, self._mass = walker, carrying, bank.mass
        made = _made(clips, bank, stands_m)
        known = reference([clip for clip, _ in made], starts=False) if made else None
        self._pick = None if known is None else _variants(made, known, picks=True)
        if self._pick is None:
            raise ClipError(
                "no clip in which someone who stands picks up a box: a tracker cannot teach carry"
                " by these clips"
            )
        self._put = None if known is None else _variants(made, known, picks=False)
        self._stage = torch.zeros(scenes, dtype=torch.int64)
        self._variant = torch.zeros(scenes, dtype=torch.int64)
        self._frame = torch.zeros(scenes, dtype=torch.int64)
        #: From the clip's axes to the scene's, rad, and quarter turns from the box's to the clip's.
        self._yaw = torch.zeros(scenes)
        self._turns = torch.zeros(scenes, dtype=torch.int64)
        #: Where the box stands, or stood until it was taken, m.
        self._stood = torch.zeros(scenes, 3)

    def reset(self, rows: Tensor, target: Target) -> None:
        """Forget the variants that these scenes followed."""
        for value in self.state_dict().values():
            value[rows] = 0
        if self._walker is not None:
            self._walker.reset(rows, target)

    def label(self, scenes: Scenes, target: Target, variant: Tensor, clock: int) -> Tensor:
        """Teacher actions [n, 28] float32, in the student's units; NaN where no part has a
        label."""
        assert target.box is not None
        body, box = scenes.body(), target.box
        gone = taken(body, box)
        self._stood = torch.where(gone[:, None], self._stood, box.position)
        if self._walker is None:
            found = torch.full((len(gone), NU), torch.nan)
            stands = body.root_velocity[:, :2].norm(dim=1) < _SLOW_M_S
        else:
            found = self._walker.label(scenes, target, variant, clock)
            stands = found.isnan().any(dim=1)
        self._begin(body, box, stands & ~gone, gone)
        for stage, variants in ((_PICKING, self._pick), (_PUTTING, self._put)):
            rows = torch.nonzero(self._stage == stage).flatten()
            if variants is not None and len(rows):
                found[rows] = self._follow(scenes, rows, variants, box, self._mass[variant[rows]])
        carrying = gone & (self._stage == _FREE) & grips(body, box)
        if self._carrying is not None and bool(carrying.any()):
            label = self._carrying.label(scenes, body, target)
            found = torch.where(carrying[:, None], label, found)
        return found

    def _begin(self, body: Body, box: BoxState, stands: Tensor, taken: Tensor) -> None:
        """Choose variants for scenes whose character `stands` [n] before a box, or comes to the
        target with one that is `taken` [n]."""
        free = self._stage == _FREE
        rows = torch.nonzero(free & stands).flatten()
        if len(rows):
            self._choose_pick(rows, body, box)
        if self._put is None:
            return
        near = (box.position - box.target)[:, :2].norm(dim=1) < _PUTS_M
        near &= body.root_velocity[:, :2].norm(dim=1) < _ARRIVES_M_S
        rows = torch.nonzero(free & taken & near & grips(body, box)).flatten()
        if len(rows):
            self._choose_put(rows, body, box, self._put)

    def _choose_pick(self, rows: Tensor, body: Body, box: BoxState) -> None:
        """Choose variants and yaws for the scenes `rows` whose character stands before the box."""
        variants = self._pick
        assert variants is not None
        half, stood = box.half[rows], self._stood[rows]
        stand = stood[:, 2] - half[:, 2]
        here, heading = body.root[rows, :2] - stood[:, :2], body.heading[rows]
        yaw = rotations.yaw(rotations.heading(box.rotation[rows]))
        first = variants.keys[variants.low, 0, :2] - variants.anchor[:, :2]
        back = rotations.cos_sin(variants.anchor[:, 3])
        place = rotations.turn_back(back, first)
        ahead = rotations.turn_back(back, variants.reference.heading[variants.low])
        costs = []
        for turn in range(4):
            turned_by = rotations.cos_sin(yaw + turn * QUARTER)
            local = rotations.turn_back(turned_by, here)
            off = (local[:, None] - place).norm(dim=2)
            faces = rotations.turn_back(turned_by, heading) @ ahead.T > FACES
            costs.append(torch.where((off < _BEGINS_M) & faces, off, torch.inf))
        cost = torch.stack(costs, dim=1)
        cost = cost + torch.stack([_misfit(half, stand, variants, t) for t in range(4)], dim=1)
        best, chosen = cost.flatten(1).min(dim=1)
        turns, number = chosen // cost.shape[2], chosen % cost.shape[2]
        fits = best.isfinite()
        rows, turns, number, yaw = rows[fits], turns[fits], number[fits], yaw[fits]
        self._stage[rows], self._variant[rows], self._turns[rows] = _PICKING, number, turns
        self._yaw[rows] = yaw + turns * QUARTER - variants.anchor[number, 3]
        self._frame[rows] = -1

    def _choose_put(self, rows: Tensor, body: Body, box: BoxState, variants: _Variants) -> None:
        """Choose variants for the scenes `rows` with the box in hand: seen from the character, the
        clip's person faces where it does."""
        half, stand = box.half[rows], box.target[rows, 2] - box.half[rows, 2]
        heading = body.heading[rows]
        turns = quarter_turns(heading, box.rotation[rows])
        cost = torch.stack([_misfit(half, stand, variants, t) for t in range(4)], dim=1)
        number = cost[torch.arange(len(rows)), turns].argmin(dim=1)
        theirs = variants.facing[number]
        self._stage[rows], self._variant[rows], self._turns[rows] = _PUTTING, number, turns
        self._yaw[rows] = rotations.yaw(heading) - rotations.yaw(theirs)
        self._frame[rows] = -1

    def _follow(
        self, scenes: Scenes, rows: Tensor, variants: _Variants, box: BoxState, mass: Tensor
    ) -> Tensor:
        """Labels [m, 28] of the scenes `rows`, and their next frames."""
        known, number = variants.reference, self._variant[rows]
        turns, back = self._turns[rows], rotations.cos_sin(-self._yaw[rows])
        box = box.rows(rows)
        body, seen = _seen(scenes, rows, box, back, turns)
        picks = variants is self._pick
        anchor = level(back, self._stood[rows]) if picks else seen.target
        origin = torch.cat(
            (anchor[:, :2] - variants.anchor[number, :2], 0.0 * mass[:, None]), dim=1
        )
        frames = followed(variants.low[number], variants.high[number], _BEFORE + _AFTER + 1)
        here = body.position[:, KEYS] - origin[:, None]
        away = here[:, None] - variants.keys[frames]
        moved = (seen.position - origin)[:, None] - known.box[frames, :3]
        distance = (away.square().sum(dim=3) * _WEIGHT).sum(dim=2)
        distance = distance + _BOX_WEIGHT * moved.square().sum(dim=2)
        frame = advanced(self._frame[rows], distance, frames)
        there = TrackTarget(
            origin, back, seen.corners(), origin, seen,
            reference=known, residual=self._residual, frame=frame, origin=origin,
            lost=torch.zeros_like(frame), mass=mass,
        )  # fmt: skip
        label = labels(self._act, self._residual, scenes, body, there)
        self._frame[rows] = frame
        strayed = away[:, 0, 0, :2].norm(dim=1) > _LEAVES_M
        turned_away = torch.zeros_like(strayed)
        if picks:
            turned_away = (body.heading * known.heading[frame]).sum(dim=1) < _TURNS_AWAY
            turned_away &= frame < variants.grip[number]
        done = (frame >= variants.high[number]) | strayed | turned_away
        self._stage[rows[done]] = _FREE
        lost = (distance.amin(dim=1) > LOST_M2) | turned_away
        return torch.where(lost[:, None], torch.nan, label)

    def state_dict(self) -> dict[str, Tensor]:
        """Which variants the scenes follow, and where in them."""
        return {
            "stage": self._stage,
            "variant": self._variant,
            "frame": self._frame,
            "yaw": self._yaw,
            "turns": self._turns,
            "stood": self._stood,
        }

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Restore what `state_dict` gave."""
        for name, value in self.state_dict().items():
            if name in state or name != "stood":
                value.copy_(state[name])
        if "stood" not in state:  # a run of before: it chooses pick-ups again
            self._stage[self._stage == _PICKING] = _FREE


def _seen(
    scenes: Scenes, rows: Tensor, box: BoxState, back: Tensor, turns: Tensor
) -> tuple[Body, BoxState]:
    """Return the characters and boxes of the scenes `rows` in the clips' axes: turned by back
    [m, 2] (cosine, sine), and the box's own axes by quarter turns [m]."""
    turn = rotations.from_heading(back)
    own = rotations.from_heading(rotations.cos_sin(turns * QUARTER))
    seen = replace(
        box,
        position=level(back, box.position),
        rotation=rotations.multiply(rotations.multiply(turn, box.rotation), own),
        velocity=level(back, box.velocity),
        half=half_turned(box.half, turns),
        start=level(back, box.start),
        target=level(back, box.target),
    )
    return turned(scenes, rows, back), seen


def _misfit(half: Tensor, stand: Tensor, variants: _Variants, turns: int) -> Tensor:
    """[n, V]: cost of each variant for boxes of these half edges [n, 3] and stands [n], m, whose
    axes are turned by quarter turns."""
    wanted = half_turned(half, torch.full((len(half),), turns))
    high = (stand[:, None] - variants.stand).abs()
    return misfit(wanted, variants.half) + _STAND_COST * high


def _made(
    clips: Sequence[Clip], bank: Boxes, stands_m: tuple[float, float]
) -> list[tuple[Clip, float]]:
    """Return the variants for a bank's boxes with the heights of their stands, m; those of which
    neither a pick-up nor putting down is followed are left out."""
    made: list[tuple[Clip, float]] = []
    for clip in originals(clips):
        assert clip.box is not None
        for edges in sizes(bank):
            factors = edges / np.asarray(clip.box.size_m)
            for stand in _steps(stands_m):
                found = variant(clip, stand, factors.tolist())
                if found is not None and any(_cut(found, picks) for picks in (True, False)):
                    made.append((found, stand))
    return made


def _cut(clip: Clip, picks: bool) -> tuple[int, int, int] | None:
    """Return the first frame of a clip's pick-up or putting down, that of the grip or release, and
    the last; None where it is not followed."""
    assert clip.box is not None
    held = np.flatnonzero(clip.box.held)
    at = int(held[0]) if picks else int(held[-1]) + 1
    low, high = max(0, at - _BEFORE), min(clip.frames - 1, at + _AFTER)
    if picks:
        # the same speed as of the whole clip
        near = clip.part(max(0, low - 1), min(clip.frames, low + 2))
        stands = float(np.linalg.norm(near.qvel()[min(low, 1), :2])) < _STANDS_M_S
        followed = at > 0 and stands
    else:
        followed = at < clip.frames
    return (low, min(at, high), high) if followed else None


def _variants(
    made: Sequence[tuple[Clip, float]], known: Reference, picks: bool
) -> _Variants | None:
    """Return those of the variants of which a pick-up, or putting down, is followed; None without
    one.

    known: the reference of them all.
    """
    cuts = [_cut(clip, picks) for clip, _ in made]
    rows = [(number, *cut) for number, cut in enumerate(cuts) if cut is not None]
    if not rows:
        return None
    number, low, at, high = (torch.tensor(column) for column in zip(*rows, strict=True))
    first, stop = known.first[number], known.stop[number]
    stand = torch.tensor([height for _, height in made])[number]
    anchor = (known.picked if picks else known.put)[number]
    low, at, high = first + low, first + at, torch.minimum(first + high, stop - 1)
    low = _moving(known, low, at)
    if picks:
        high = _raised(known, at, high)
    half = 0.5 * known.size[number]
    keys = known.position[:, KEYS]
    return _Variants(known, keys, low, high, anchor, at, known.heading[at], half, stand.float())


def _moving(known: Reference, low: Tensor, at: Tensor) -> Tensor:
    """Return the last frames [V] before `at` [V] in which the person still stands as at `low` [V].

    Labels of a person who stands and waits would teach to stand and wait: a student that does not
    see the reference cannot tell when to begin.
    """
    found = low.clone()
    for number, (first, last) in enumerate(zip(low.tolist(), at.tolist(), strict=True)):
        keys = known.position[first : last + 1, KEYS]
        stands = (keys - keys[0]).norm(dim=2).amax(dim=1) < _WAITS_M
        found[number] = first + int(torch.nonzero(stands)[-1])
    return found


def _raised(known: Reference, at: Tensor, high: Tensor) -> Tensor:
    """Return the first frames [V] after `at` [V] from which the person stands as at `high` [V].

    Labels of a person who stands with the box in hand would teach to stand there.
    """
    found = high.clone()
    for number, (first, last) in enumerate(zip(at.tolist(), high.tolist(), strict=True)):
        keys = known.position[first : last + 1, KEYS]
        moves = torch.nonzero((keys - keys[-1]).norm(dim=2).amax(dim=1) >= _RAISED_M).flatten()
        frames = int(moves[-1]) + 1 if len(moves) else 0
        found[number] = min(last, first + max(_LIFTS, frames))
    return found


def _steps(stands_m: tuple[float, float]) -> list[float]:
    """Heights of stands, m, from the lowest to the highest."""
    low, high = stands_m
    count = max(1, round((high - low) / _STANDS_M)) + 1
    return [float(height) for height in np.linspace(low, high, count)]

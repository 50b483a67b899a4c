"""A walking policy as the teacher of the way with a box in hand.

But for the arms it is the walker, led to where the box is put down; the arms have the set-points of
people who walk with such a box: those of a clip, adapted to the size of the box. A walker that sees
its arms held up before it has never been there, and falls within two seconds whatever the box
weighs: it sees the arms as they are on the mean of its training.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from world import tasks
from world.character import features
from world.character.features import Body
from world.character.model import ARM_CONTROLS
from world.motions.clip import Clip
from world.motions.variants import variant
from world.scene.batch import Scenes
from world.scene.target import BoxState, Target
from world.tasks.walk import Walk
from world.teachers.boxes import Boxes, half_turned, misfit, originals, quarter_turns, sizes
from world.teachers.tracker import Act
from world.teachers.walker import SHORT_M
from world.tracking.reference import reference

#: Frames in which a clip's person walks are faster than this, m/s.
_WALKS_M_S = 0.5
#: Bounds of the distance from the root to the box ahead of it, m.
_AHEAD_M = (0.25, 0.70)
#: Until the root is so far from the middle of the stand that the box was taken from, m, a character
#: steps back; its goal is so far behind it, m.
_CLEAR_M, _BACK_M = 0.80, 0.5


def _arm_features() -> list[int]:
    """The numbers of the state's features that describe the arms."""
    first = features.STATE.slice("joint_velocity").start
    found = [first + control for control in ARM_CONTROLS]
    for name in ("rotation_{}_shoulder", "angle_{}_elbow", "position_{}_hand"):
        for side in ("right", "left"):
            part = features.STATE.slice(name.format(side))
            found += range(part.start, part.stop)
    return found


_ARMS = _arm_features()


@dataclass(frozen=True)
class _Holds:
    """How people hold V boxes while they walk."""

    half: Tensor
    """[V, 3]: half edges, m; y along the line between the hands."""
    arms: Tensor
    """[V, A]: set-points of the arms, rad: medians over the frames."""


class CarryingWalker:
    """Labels of scenes with the box in hand, without state of its own."""

    def __init__(self, act: Act, usual: Tensor, holds: _Holds) -> None:
        """act: actions [n, 28] of states [n, 114] and goals [n, 5] of the task walk; usual [114]:
        the mean of the states that it was trained on."""
        self._act, self._usual, self._holds, self._task = act, usual, holds, Walk()

    def label(self, scenes: Scenes, body: Body, target: Target) -> Tensor:
        """Teacher actions [n, 28] float32, in the student's units, of the scenes' characters."""
        box = target.box
        assert box is not None
        aim, facing = to_target(body, box)
        point = torch.cat((aim, torch.zeros_like(aim[:, :1])), dim=1)
        walk = Target(point, facing, target.corners)
        state = tasks.state(body, walk)
        state[:, _ARMS] = self._usual[_ARMS]
        action = self._act(state, self._task.goal_features(body, walk))
        wanted = scenes.set_points(action).clone()
        half = half_turned(box.half, quarter_turns(body.heading, box.rotation))
        number = misfit(half, self._holds.half).argmin(dim=1)
        wanted[:, ARM_CONTROLS] = self._holds.arms[number].to(wanted)
        return scenes.actions(wanted).to(torch.float32)


def carrying_walker(
    act: Act, usual: Tensor, clips: Sequence[Clip], bank: Boxes
) -> CarryingWalker | None:
    """Return the teacher for a bank's boxes, act and usual as of CarryingWalker; None where no clip
    walks with a box."""
    made = []
    for clip in originals(clips):
        assert clip.box is not None
        if not _walks(clip).any():
            continue
        for edges in sizes(bank):
            found = variant(clip, 0.0, (edges / np.asarray(clip.box.size_m)).tolist())
            if found is not None and found.box is not None and _walks(found).any():
                made.append(found)
    if not made:
        return None
    known = reference(made, starts=False)
    arms = []
    for number, clip in enumerate(made):
        first = int(known.first[number])
        frames = first + torch.from_numpy(np.flatnonzero(_walks(clip)))
        arms.append(known.set_point[frames][:, ARM_CONTROLS].median(dim=0).values)
    return CarryingWalker(act, usual, _Holds(0.5 * known.size, torch.stack(arms)))


def _walks(clip: Clip) -> np.ndarray:
    """[T] bool: frames in which the person walks with the box in hand."""
    assert clip.box is not None
    return clip.box.held & (np.linalg.norm(clip.qvel()[:, :2], axis=1) > _WALKS_M_S)


def to_target(body: Body, box: BoxState) -> tuple[Tensor, Tensor]:
    """Where a character with the box in hand walks: the floor point [n, 2], m, and the unit vector
    [n, 2] to face there. First back from the stand, then to where the box is over its target."""
    here = body.root[:, :2]
    ahead = ((box.position[:, :2] - here) * body.heading).sum(dim=1).clamp(*_AHEAD_M)
    way = box.target[:, :2] - here
    far = way.norm(dim=1).clamp_min(1e-6)
    unit = way / far[:, None]
    beyond = (far - ahead).clamp_min(0.0)
    aim = here + unit * (beyond + beyond.clamp_max(SHORT_M))[:, None]
    stand = box.start[:, :2] - here
    near = stand.norm(dim=1) < _CLEAR_M
    # a stand that is behind is in nobody's way
    near &= (stand * body.heading).sum(dim=1) > 0.0
    aim = torch.where(near[:, None], here - _BACK_M * body.heading, aim)
    return aim, torch.where(near[:, None], body.heading, unit)

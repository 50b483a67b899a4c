"""A trained walking policy as the teacher of the approach to a box.

While the box rests where it was, the walker's goal is to stand before the box's nearest face. What
comes then, others teach.
"""

from collections.abc import Mapping

import torch
from torch import Tensor

from world import tasks
from world.scene.batch import Scenes
from world.scene.target import BoxState, Target
from world.tasks.carry import DEPTH_COST, MIN_HALF_DEPTH_M, half_depths, stand_poses
from world.tasks.walk import Walk
from world.teachers.tracker import Act

#: Who picks a box up stands so far before its face, m (ACCAD's A5 and B19: 0.15 to 0.24).
_GAP_M = 0.18
#: The approach ends within the first distance of there, m, or within the second for one that
#: is slower than this, m/s: from there on people bend and reach.
_THERE_M, _NEAR_M, _SLOW_M_S = 0.08, 0.2, 0.05
#: A walker stops so far before its goal, m, which is therefore set beyond the place.
_SHORT_M = 0.2
#: A box this far from where it was has been taken, m.
TAKEN_M = 0.05


class WalkerTeacher:
    """Labels scenes of carry in which the box is not reached yet; a
    world.teachers.teacher.Teacher without state of its own."""

    def __init__(self, act: Act) -> None:
        """act: actions [n, 28] of states [n, 114] and goals [n, 5] of the task walk."""
        self._act, self._task = act, Walk()

    def reset(self, rows: Tensor, target: Target) -> None:
        """Nothing: a walker acts on the present state alone."""

    def label(self, scenes: Scenes, target: Target, variant: Tensor, clock: int) -> Tensor:
        """Teacher actions [n, 28] float32; NaN where the box is reached or taken."""
        assert target.box is not None
        body, box = scenes.body(), target.box
        point, ahead = standing_place(body.root[:, :2], box)
        beyond = point - body.root[:, :2]
        far = beyond.norm(dim=1, keepdim=True).clamp_min(1e-6)
        aim = point + beyond / far * far.clamp_max(_SHORT_M)
        walk = Target(torch.cat((aim, torch.zeros_like(aim[:, :1])), 1), ahead, target.corners)
        goal = self._task.goal_features(body, walk)
        action = self._act(tasks.state(body, walk), goal).to(torch.float32)
        away = (point - body.root[:, :2]).norm(dim=1)
        stands = body.root_velocity[:, :2].norm(dim=1) < _SLOW_M_S
        there = (away < _THERE_M) | (stands & (away < _NEAR_M))
        taken = (box.position - box.start).norm(dim=1) > TAKEN_M
        return torch.where((there | taken)[:, None], torch.nan, action)

    def state_dict(self) -> dict[str, Tensor]:
        """Nothing."""
        return {}

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Nothing."""


def standing_place(here: Tensor, box: BoxState) -> tuple[Tensor, Tensor]:
    """Return the floor points [n, 2], m, before the box's faces that are nearest to `here` [n, 2],
    m, and the headings [n, 2] towards the box; a deep box is taken from its long side."""
    ahead, _ = stand_poses(box)
    points = box.position[:, None, :2] - ahead * (half_depths(box) + _GAP_M)[..., None]
    deeper = (half_depths(box) - MIN_HALF_DEPTH_M).clamp_min(0.0)
    face = ((points - here[:, None]).norm(dim=2) + DEPTH_COST * deeper).argmin(dim=1)
    rows = torch.arange(len(face), device=face.device)
    return points[rows, face], ahead[rows, face]

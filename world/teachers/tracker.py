"""A trained tracking policy as the teacher of a policy to which the reference is hidden.

Both are in the same state of the same scenes. The tracker sees the reference's next frames; the
student sees a task's goal. Its labels are what the tracker would do (DAgger, as InterMimic and
MaskedMimic distil trackers).
"""

from collections.abc import Callable, Mapping

import torch
from torch import Tensor

from world import tasks
from world.character.features import Body
from world.scene.batch import Scenes
from world.scene.target import Target
from world.tasks.track import Track
from world.tracking.target import TrackTarget, tracked

Act = Callable[[Tensor, Tensor], Tensor]
"""Actions [n, 28] of states [n, 114] and goals [n, g] of the task track."""


_TRACK = Track()
#: Rows of a forward pass are filled up to a multiple of this: one of few rows rounds otherwise, and
#: how many scenes are labelled at a time depends on the number of workers.
_LANES = 32


def whole(rows: Tensor) -> Tensor:
    """Rows [m, d] with the last one repeated, up to a multiple of _LANES."""
    padding = -len(rows) % _LANES
    return torch.cat((rows, rows[-1:].expand(padding, -1))) if padding else rows


def labels(act: Act, residual: bool, scenes: Scenes, body: Body, target: TrackTarget) -> Tensor:
    """Return what a tracker does [m, 28] float32 for characters that follow a reference, as actions
    about the neutral set-points, which those of a student are.

    residual: its own actions are added to the reference's set-points. body, target: in the same
    axes, which need not be the scenes'.
    """
    state, goal = tasks.state(body, target), _TRACK.goal_features(body, target)
    action = act(whole(state), whole(goal))[: len(state)]
    base = target.reference_set_points() if residual else None
    return scenes.actions(scenes.set_points(action, base)).to(torch.float32)


class TrackerTeacher:
    """Labels scenes that follow clips; a world.teachers.teacher.Teacher without state of its
    own."""

    def __init__(self, act: Act, residual: bool) -> None:
        """residual: the tracker's actions are added to the reference's set-points, not to the
        neutral ones."""
        self._act, self._residual = act, residual

    def reset(self, rows: Tensor, target: Target) -> None:
        """Nothing: a tracker acts on the present state alone."""

    def label(self, scenes: Scenes, target: Target, variant: Tensor, clock: int) -> Tensor:
        """Teacher actions [n, 28] float32, in the student's units: about the neutral set-points."""
        return labels(self._act, self._residual, scenes, scenes.body(), tracked(target))

    def state_dict(self) -> dict[str, Tensor]:
        """Nothing."""
        return {}

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Nothing."""

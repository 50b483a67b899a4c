"""A policy of the scenes' own task as a teacher: it labels what no other teacher labels.

A student of teachers that know one part each forgets what its first policy could do beside them.
With that policy as the expert it keeps it: its labels are the policy's own actions there.
"""

from collections.abc import Mapping

import torch
from torch import Tensor

from world import tasks
from world.character.model import NU
from world.scene.batch import Scenes
from world.scene.target import Target
from world.tasks.task import Task
from world.teachers.teacher import Teacher
from world.teachers.tracker import Act, whole


class ExpertTeacher:
    """Labels scenes of a task by another teacher, and the rest by a policy of this task; a
    world.teachers.teacher.Teacher whose state is the other one's."""

    def __init__(self, act: Act, task: Task, first: Teacher | None = None) -> None:
        """act: of the task's own states and goals. first: whose labels count where it has any."""
        self._act, self._task, self._first = act, task, first

    def reset(self, rows: Tensor, target: Target) -> None:
        """See Teacher."""
        if self._first is not None:
            self._first.reset(rows, target)

    def label(self, scenes: Scenes, target: Target, variant: Tensor, clock: int) -> Tensor:
        """See Teacher; without NaN."""
        if self._first is None:
            found = torch.full((scenes.n, NU), torch.nan)
        else:
            found = self._first.label(scenes, target, variant, clock)
        rows = torch.nonzero(found.isnan().any(dim=1)).flatten()
        if len(rows):
            # all scenes are computed: a row's rounding must not depend on how many are asked for
            body = scenes.body()
            state, goal = tasks.state(body, target), self._task.goal_features(body, target)
            own = self._act(whole(state), whole(goal))[: len(state)]
            points = scenes.set_points(own, target.set_points())
            found[rows] = scenes.actions(points)[rows].to(torch.float32)
        return found

    def state_dict(self) -> dict[str, Tensor]:
        """See Teacher."""
        return {} if self._first is None else self._first.state_dict()

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """See Teacher."""
        if self._first is not None:
            self._first.load_state_dict(state)

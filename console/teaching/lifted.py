"""States in which boxes were last lifted, as initial states of later episodes."""

from collections.abc import Mapping

import torch
from torch import Tensor

from world.objects.box_bank import Layout


class LiftedStates:
    """The states of n scenes in which the box was last lifted, with the teacher's state."""

    def __init__(
        self, qpos: Tensor, qvel: Tensor, layout: Layout, teacher: Mapping[str, Tensor]
    ) -> None:
        self.exists = torch.zeros(len(qpos), dtype=torch.bool)
        """[n] True for a scene with such a state."""
        self.qpos, self.qvel = qpos.clone(), qvel.clone()
        self.layout = Layout(**{name: part.clone() for name, part in vars(layout).items()})
        self.teacher = {name: part.clone() for name, part in teacher.items()}

    def keep(
        self, rows: Tensor, qpos: Tensor, qvel: Tensor, at: Layout, teacher: Mapping[str, Tensor]
    ) -> None:
        """Store the states of the scenes `rows` [m]; teacher: its state in all n."""
        self.exists[rows], self.qpos[rows], self.qvel[rows] = True, qpos, qvel
        overwrite(self.layout, rows, at)
        for name, part in self.teacher.items():
            part[rows] = teacher[name][rows]


def overwrite(layout: Layout, rows: Tensor, part: Layout) -> None:
    """Overwrite the scenes `rows` [m] of a layout with `part` [m]."""
    for name, value in vars(part).items():
        getattr(layout, name)[rows] = value

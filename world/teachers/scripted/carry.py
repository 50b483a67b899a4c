"""The teacher of the carry task: labels of the scripted controller, which observes the student."""

from collections.abc import Mapping, Sequence

import torch
from torch import Tensor

from world.character import model as character
from world.objects.bank import ObjectBank
from world.scene.batch import Scenes
from world.scene.target import Target
from world.teachers.scripted.controller import CarryController, lifted

#: Each scene is labelled in two of five control steps: labels in all steps cost more time than they
#: teach. A period of five is no divisor of a walking step's eleven.
_LABELLED, _PERIOD = 2, 5
#: Names of the state in older checkpoints, where they differ.
_RENAMED = {
    "_age": "age",
    "_face": "face",
    "_straight": "straight",
    "_halts": "halts",
    "_wish": "step_command",
    "_yaw_rad": "yaw_rad",
    "_spin": "spin",
    "_velocity": "velocity",
    "gait_balks": "gait_stalled",
    "gait__flew": "gait_flew",
    "gait__lifted": "gait_lifted",
    "gait__lifted_yaw": "gait_lifted_yaw",
    "gait__goal": "gait_goal",
}


class CarryTeacher:
    """Labels the scenes `scenes` (global ids) near the box and where the student stalls;
    a world.teachers.teacher.Teacher."""

    def __init__(self, mass_kg: Tensor, scenes: Sequence[int]) -> None:
        """mass_kg [V]: of the boxes of the bank."""
        self.controller = CarryController(len(scenes))
        self._mass_kg = mass_kg
        self._ids = torch.tensor(scenes, dtype=torch.int64)

    @staticmethod
    def of_bank(bank: ObjectBank, scenes: Sequence[int]) -> "CarryTeacher":
        """The teacher of scenes whose objects are the boxes of `bank`."""
        mass_kg = getattr(bank, "mass", None)
        assert mass_kg is not None, "the teacher of carry needs boxes"
        return CarryTeacher(mass_kg, scenes)

    def reset(self, rows: Tensor, target: Target) -> None:
        """Begin new episodes in the scenes `rows` [m]; a lifted box is in hand."""
        assert target.box is not None
        self.controller.reset(rows, lifted(target.box))

    def label(self, scenes: Scenes, target: Target, variant: Tensor, clock: int) -> Tensor:
        """Teacher actions [n, 28]; NaN where the label is not useful and in three of five steps."""
        mass_kg = self._mass_kg[variant]
        intent = self.controller.intend(scenes.qpos, scenes.qvel, target, mass_kg)
        useful = self.controller.is_useful(target, scenes.qpos[:, :3].float())
        turn = (_LABELLED * clock + self._ids) % _PERIOD < _LABELLED
        rows = torch.nonzero(useful & turn).flatten()
        actions = torch.full((len(self._ids), character.NU), torch.nan)
        actions[rows] = scenes.actions(intent.rows(rows).set_points()).float()
        return actions

    def state_dict(self) -> dict[str, Tensor]:
        """The controller's state."""
        return self.controller.state_dict()

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Restore what `state_dict` gave."""
        self.controller.load_state_dict({_RENAMED.get(k, k): v for k, v in state.items()})

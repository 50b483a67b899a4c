"""The object of the one scene that is played: furniture, or a box with its two stands."""

import math
from collections.abc import Sequence
from typing import Protocol

import mujoco
import torch
from torch import Tensor

from console.play.setup import Pose, Setup
from world.config import CarryConfig
from world.furniture.piece import Piece
from world.objects.box_bank import BoxBank, resting
from world.objects.furniture_bank import Bank
from world.objects.targets import spots
from world.scene.batch import Scenes
from world.scene.model import Ball
from world.tasks import Place
from world.tasks.task import Affordance

_HERE = torch.zeros(1, dtype=torch.int64)


class Object(Protocol):
    """What the character uses."""

    model: mujoco.MjModel

    def begin(self, scenes: Scenes) -> None:
        """Put everything where the setup has it; the character is not touched."""
        ...

    def move(self, scenes: Scenes, goal: Pose) -> None:
        """Put the goal elsewhere: the furniture, or the stand that the box goes to."""
        ...

    def place(self, scenes: Scenes) -> Place:
        """What the task must know of it now."""
        ...


def object_of(
    setup: Setup, piece: Piece, affordance: Affordance, carry: CarryConfig, balls: Sequence[Ball]
) -> Object:
    """The object of a setup, compiled."""
    if affordance == "carry":
        return CarriedBox(setup, piece, carry, balls)
    return Furniture(setup, piece, affordance, balls)


class Furniture:
    """A piece to sit or lie on, placed by its place of use."""

    def __init__(
        self, setup: Setup, piece: Piece, affordance: Affordance, balls: Sequence[Ball]
    ) -> None:
        assert affordance != "carry"
        # a bank gives its variants the places of a piece in turn
        count = min(setup.side + 1, len(spots(piece, affordance)))
        self._bank = Bank([piece] * count, affordance, balls)
        self._variant = torch.tensor([count - 1])
        self.model = self._bank.models[-1]
        self._goal = setup.goal

    def begin(self, scenes: Scenes) -> None:
        """See Object."""
        self.move(scenes, self._goal)

    def move(self, scenes: Scenes, goal: Pose) -> None:
        """See Object."""
        self._goal = goal
        scenes.move_furniture(_HERE, *self._bank.placed(self._variant, *_tensors(goal)))

    def place(self, scenes: Scenes) -> Place:
        """See Object."""
        return self._bank.place(self._variant, *_tensors(self._goal))


class CarriedBox:
    """A box on a stand, and the stand that it is to be brought to, both of the middle height."""

    def __init__(
        self, setup: Setup, piece: Piece, carry: CarryConfig, balls: Sequence[Ball]
    ) -> None:
        self._bank = BoxBank([piece], balls)
        self.model = self._bank.models[0]
        height = sum(carry.stand_m) / 2 + float(self._bank.half[0, 2])
        self._up = torch.tensor([[height]])
        box, facing = _tensors(setup.box)
        goal, _ = _tensors(setup.goal)
        self._layout = resting(
            torch.cat((box, self._up), dim=1), facing, torch.cat((goal, self._up), dim=1)
        )

    def begin(self, scenes: Scenes) -> None:
        """See Object."""
        self._bank.put(scenes, _HERE, _HERE, self._layout)

    def move(self, scenes: Scenes, goal: Pose) -> None:
        """See Object."""
        self._layout.target[0, :2] = _tensors(goal)[0][0]
        top = self._layout.target.clone()
        top[:, 2] -= self._bank.half[0, 2]
        scenes.move_stand(_HERE, top)

    def place(self, scenes: Scenes) -> Place:
        """See Object."""
        return scenes.now(self._bank.place(_HERE, self._layout))


def _tensors(pose: Pose) -> tuple[Tensor, Tensor]:
    """Floor point [1, 2] m and heading [1, 2] (cosine, sine)."""
    point = torch.tensor([[pose.x, pose.y]])
    return point, torch.tensor([[math.cos(pose.yaw), math.sin(pose.yaw)]])

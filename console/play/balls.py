"""Balls thrown at the character on demand, like those of `evaluate --perturb projectiles`."""

import torch

from world.character.features import Body
from world.scene.batch import Scenes
from world.scene.model import Ball
from world.scene.perturbations import Disturbance, Throwing
from world.scene.perturbations import Thrower as Timetable

HOW = Throwing()
#: Launch step of a ball that is not thrown.
_NEVER = -1


class Thrower:
    """The balls of one scene; each throw uses the ball whose last throw is oldest."""

    def __init__(self, scenes: Scenes, seed: int) -> None:
        self._random = torch.Generator().manual_seed(seed)
        self._what = Disturbance(
            "projectiles",
            torch.full((1, HOW.flying), _NEVER),
            torch.zeros(1, HOW.flying, 4),
            HOW,
        )
        self._scenes, self._next = scenes, 0
        self._timetable = Timetable(self._what, scenes)

    @staticmethod
    def balls() -> tuple[Ball, ...]:
        """Return the balls that the scene must hold."""
        return (HOW.ball,) * HOW.flying

    def throw(self, step: int) -> None:
        """Launch one ball before the control step `step`, from any side at a random body."""
        self._what.step[0, self._next] = step
        self._what.draw[0, self._next] = torch.rand(4, generator=self._random)
        self._next = (self._next + 1) % HOW.flying

    def step(self, step: int, body: Body, seconds: float) -> None:
        """Launch the balls that are due and remove those whose time is over."""
        self._timetable.step(step, body, seconds)

    def position(self) -> torch.Tensor:
        """Return positions [flying, 3] m, world; NaN for balls out of the scene."""
        return self._timetable.position[0]

    def clear(self) -> None:
        """Remove all balls, after the scene was reset."""
        self._what.step[:] = _NEVER
        self._timetable = Timetable(self._what, self._scenes)

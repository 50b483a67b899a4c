"""Balls thrown at the character on demand, as those of `inhabit evaluate --perturb projectiles`."""

import torch

from world.character.features import Body
from world.scene.batch import Scenes
from world.scene.model import Ball
from world.scene.perturbations import Disturbance, Throwing
from world.scene.perturbations import Thrower as Timetable

HOW = Throwing()
#: Of a ball that has no turn.
_NEVER = -1


class Thrower:
    """The balls of one scene; each throw takes the one that has lain longest."""

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
        """What the scene must have for it."""
        return (HOW.ball,) * HOW.flying

    def throw(self, step: int) -> None:
        """Launch one ball before the control step `step`, from any side at a random body."""
        self._what.step[0, self._next] = step
        self._what.draw[0, self._next] = torch.rand(4, generator=self._random)
        self._next = (self._next + 1) % HOW.flying

    def step(self, step: int, body: Body, seconds: float) -> None:
        """Launch what is due, and take away what has lain long enough."""
        self._timetable.step(step, body, seconds)

    def position(self) -> torch.Tensor:
        """[flying, 3] m, world; not a number for balls that wait."""
        return self._timetable.position[0]

    def clear(self) -> None:
        """Take all balls away: the scene is another one."""
        self._what.step[:] = _NEVER
        self._timetable = Timetable(self._what, self._scenes)

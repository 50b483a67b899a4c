"""`inhabit teach try`: evaluation of the scripted teacher in the trials of policies.

Noise gives its actions errors like those of a student. If the teacher then falls, its students
fall.
"""

import math
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import torch
from torch import Tensor

from console.commands.teaching import TeachTry
from console.evaluation import trials
from console.evaluation.command import scored
from console.evaluation.scores import Protocol
from world.affordances.box import boxes
from world.character.model import NU
from world.config import WorldConfig
from world.scene.batch import Scenes
from world.scene.target import Target
from world.tasks.carry import Carry
from world.teachers.scripted.controller import CarryController

#: Correlation of the action error between two control steps.
_CORRELATION = 0.8


@dataclass
class Chunk:
    """The state of one chunk of trials."""

    controller: CarryController
    mass_kg: Tensor
    """[n] masses of the boxes."""
    error: Tensor
    """[n, 28] present error of the actions."""
    draw: torch.Generator


class TeacherDriver:
    """Driver by the scripted teacher, with controllers for each chunk."""

    def __init__(self, noise: float) -> None:
        self._noise = noise
        self._chunks: WeakKeyDictionary[Scenes, Chunk] = WeakKeyDictionary()

    def __call__(self, scenes: Scenes, state: Tensor, goal: Tensor, target: Target) -> None:
        if scenes not in self._chunks:
            mass = [float(model.body("box").mass[0]) for model in scenes.models]
            none, draw = torch.zeros(scenes.n, NU), torch.Generator().manual_seed(0)
            chunk = Chunk(CarryController(scenes.n), torch.tensor(mass), none, draw)
            self._chunks[scenes] = chunk
        chunk = self._chunks[scenes]
        targets = chunk.controller.set_points(scenes.qpos, scenes.qvel, target, chunk.mass_kg)
        fresh = torch.randn(chunk.error.shape, generator=chunk.draw)
        # the squares of the two factors sum to 1, so that the variance of the error is constant
        kept, added = _CORRELATION, math.sqrt(1.0 - _CORRELATION**2)
        chunk.error = kept * chunk.error + added * self._noise * fresh
        # scenes with non-finite states are not evaluated
        scenes.act(torch.nan_to_num(scenes.actions(targets) + chunk.error))


def evaluate_teacher(command: TeachTry) -> dict[str, Any]:
    """Evaluate the scripted teacher; return the figures of an evaluation."""
    protocol = Protocol(success_m=Carry.success_m, limit_s=command.seconds)
    pieces = boxes(command.trials, command.seed, None)
    chosen = trials.manifest(pieces, command.trials, command.seed, command.near_m, command.far_m)
    world = WorldConfig(task="carry")
    driver = TeacherDriver(command.noise)
    results = trials.drive(world, driver, chosen, protocol.steps, command.threads)
    return scored(results, chosen, protocol, Carry.stages)

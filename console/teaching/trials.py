"""`inhabit teach try`: success of the scripted teacher in the trials of policies.

With noise its actions err as those of a student do. A teacher that falls then has students that
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
from console.evaluation.arrangement import boxes
from console.evaluation.command import scored
from console.evaluation.scores import Protocol
from world.character.model import NU
from world.config import WorldConfig
from world.scene.batch import Scenes
from world.tasks import Place
from world.tasks.carry import Carry
from world.teachers.controller import CarryController

#: Fraction of an error that remains a control step later.
_LASTS = 0.8


@dataclass
class Chunk:
    """The state of one chunk of trials."""

    controller: CarryController
    mass_kg: Tensor
    """[n]: of the boxes."""
    error: Tensor
    """[n, 28]: present error of the actions."""
    draw: torch.Generator


class Drive:
    """Drives the scenes of each chunk by its own controllers."""

    def __init__(self, noise: float) -> None:
        self._noise = noise
        self._chunks: WeakKeyDictionary[Scenes, Chunk] = WeakKeyDictionary()

    def __call__(self, scenes: Scenes, state: Tensor, goal: Tensor, place: Place) -> None:
        if scenes not in self._chunks:
            mass = [float(model.body("box").mass[0]) for model in scenes.models]
            none, draw = torch.zeros(scenes.n, NU), torch.Generator().manual_seed(0)
            chunk = Chunk(CarryController(scenes.n), torch.tensor(mass), none, draw)
            self._chunks[scenes] = chunk
        chunk = self._chunks[scenes]
        targets = chunk.controller.set_points(scenes.qpos, scenes.qvel, place, chunk.mass_kg)
        fresh = torch.randn(chunk.error.shape, generator=chunk.draw)
        # the squares of the two factors add up to 1: the error keeps its variance
        chunk.error = _LASTS * chunk.error + math.sqrt(1.0 - _LASTS**2) * self._noise * fresh
        # nothing of a scene that diverged is evaluated
        scenes.act(torch.nan_to_num(scenes.actions(targets) + chunk.error))


def attempt(command: TeachTry) -> dict[str, Any]:
    """Evaluate the scripted teacher; the figures of an evaluation."""
    protocol = Protocol(success_m=Carry.success_m, limit_s=command.seconds)
    pieces = boxes(command.trials, command.seed, None)
    chosen = trials.manifest(pieces, command.trials, command.seed, command.near_m, command.far_m)
    world = WorldConfig(task="carry")
    results = trials.drive(world, Drive(command.noise), chosen, protocol.steps, command.threads)
    return scored(results, chosen, protocol, Carry.stages)

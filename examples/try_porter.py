"""How often the scripted porter (world.teachers.carry) carries a box to its target, in the trials
that policies are evaluated in.

python examples/try_porter.py --trials 128
python examples/try_porter.py --trials 128 --noise 0.03

With noise it does what it wants only about, as a network that it teaches will: a porter that falls
then is a teacher whose pupils fall.
"""

import math
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import torch
import tyro
from torch import Tensor

from console.evaluation import trials
from console.evaluation.command import scored
from console.evaluation.scores import Protocol
from world.affordances.box import boxes
from world.character.model import NU
from world.config import WorldConfig
from world.scene.batch import Scenes
from world.scene.target import Target
from world.tasks.carry import Carry
from world.teachers.carry import Porter

#: Share of an error that is left a control step later.
_LASTS = 0.8


@dataclass(frozen=True)
class Settings:
    """Which trials; as of `inhabit evaluate`."""

    trials: int = 128
    """How many."""
    near_m: float = 1.0
    """Closest start, and target of a box from where it stands."""
    far_m: float = 5.0
    """Farthest start, and target of a box."""
    seconds: float = 20.0
    """Length of a trial."""
    seed: int = 0
    """Of the trials."""
    noise: float = 0.0
    """Of its actions, rms, in their own units, each error lasting some five control steps."""
    threads: int = 1
    """Chunks of trials at once."""


@dataclass
class Driven:
    """One chunk's."""

    porter: Porter
    mass_kg: Tensor
    """[n]: of the boxes."""
    error: Tensor
    """[n, 28]: of the actions, now."""
    draw: torch.Generator


class Drive:
    """Drives each chunk's scenes by a porter of their own."""

    def __init__(self, noise: float) -> None:
        self._noise = noise
        self._chunks: WeakKeyDictionary[Scenes, Driven] = WeakKeyDictionary()

    def __call__(self, scenes: Scenes, state: Tensor, goal: Tensor, place: Target) -> None:
        if scenes not in self._chunks:
            mass = [float(model.body("box").mass[0]) for model in scenes.models]
            none, draw = torch.zeros(scenes.n, NU), torch.Generator().manual_seed(0)
            self._chunks[scenes] = Driven(Porter(scenes.n), torch.tensor(mass), none, draw)
        chunk = self._chunks[scenes]
        targets = chunk.porter.act(scenes.qpos, scenes.qvel, place, chunk.mass_kg)
        fresh = torch.randn(chunk.error.shape, generator=chunk.draw)
        # the two shares' squares add up to 1: the error keeps its size
        chunk.error = _LASTS * chunk.error + math.sqrt(1.0 - _LASTS**2) * self._noise * fresh
        # of a scene that blew up nothing is looked at any more
        scenes.act(torch.nan_to_num(scenes.actions(targets) + chunk.error))


def attempt(settings: Settings) -> dict[str, Any]:
    """The figures of an evaluation."""
    protocol = Protocol(success_m=Carry.success_m, limit_s=settings.seconds)
    pieces = boxes(settings.trials, settings.seed, None)
    chosen = trials.manifest(
        pieces, settings.trials, settings.seed, settings.near_m, settings.far_m
    )
    world = WorldConfig(task="carry")
    results = trials.drive(world, Drive(settings.noise), chosen, protocol.steps, settings.threads)
    return scored(results, chosen, protocol, Carry.stages)


if __name__ == "__main__":
    figures = attempt(tyro.cli(Settings, description=__doc__))
    for name in ("success", "sustained", "falls", "time_s", "precision_m"):
        print(name, figures[name])
    for part in figures["by_stage"]:
        print(part)

"""How often the scripted porter (world.porter) carries a box to its target, in the trials that
policies are evaluated in.

python examples/try_porter.py --trials 128
"""

from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import torch
import tyro
from torch import Tensor

from console import trials
from console.arrangement import boxes
from console.evaluate import scored
from console.scores import Protocol
from world.config import WorldConfig
from world.porter import Porter
from world.scenes import Scenes
from world.tasks import Place
from world.tasks.carry import Carry


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
    threads: int = 1
    """Chunks of trials at once."""


class Drive:
    """Drives each chunk's scenes by a porter of their own."""

    def __init__(self) -> None:
        self._porters: WeakKeyDictionary[Scenes, tuple[Porter, Tensor]] = WeakKeyDictionary()

    def __call__(self, scenes: Scenes, state: Tensor, goal: Tensor, place: Place) -> None:
        if scenes not in self._porters:
            mass = [float(model.body("box").mass[0]) for model in scenes.models]
            self._porters[scenes] = Porter(scenes.n), torch.tensor(mass)
        porter, mass_kg = self._porters[scenes]
        scenes.drive(porter.act(scenes.qpos, scenes.qvel, place, mass_kg))


def attempt(settings: Settings) -> dict[str, Any]:
    """The figures of an evaluation."""
    protocol = Protocol(success_m=Carry.success_m, limit_s=settings.seconds)
    pieces = boxes(settings.trials, settings.seed, None)
    chosen = trials.manifest(
        pieces, settings.trials, settings.seed, settings.near_m, settings.far_m
    )
    world = WorldConfig(task="carry")
    results = trials.drive(world, Drive(), chosen, protocol.steps, settings.threads)
    return scored(results, chosen, protocol, Carry.stages)


if __name__ == "__main__":
    figures = attempt(tyro.cli(Settings, description=__doc__))
    for name in ("success", "sustained", "falls", "time_s", "precision_m"):
        print(name, figures[name])
    for part in figures["by_stage"]:
        print(part)

"""Policies that stand still, and characters put where they should be."""

from dataclasses import replace
from pathlib import Path

import torch
from torch import Tensor

from console.commands import Evaluate
from world.character import model as character
from world.character import servos
from world.scene.batch import Scenes
from world.tasks import Target
from world.tasks.sit import Sit

STAND = torch.from_numpy(character.standing_qpos())


def standing(scenes: Scenes, state: Tensor, goal: Tensor, place: Target) -> None:
    """Hold the servos at the standing pose."""
    scenes.batch.bind("ctrl")[:] = servos.coordinates(STAND[None]).numpy()
    scenes.batch.step(nstep=character.SUBSTEPS)


def teleported(scenes: Scenes, state: Tensor, goal: Tensor, place: Target) -> None:
    """An oracle: the hip is where it should be, the thighs level."""
    qpos = STAND.repeat(scenes.n, 1)
    qpos[:, :3] = Sit().hip(place)
    for joint in ("right_hip", "left_hip"):
        address = int(scenes.models[0].joint(joint).qposadr[0])
        qpos[:, address : address + 4] = torch.tensor([0.5**0.5, 0.0, -(0.5**0.5), 0.0])
    scenes.qpos[:] = qpos


def command(**flags: object) -> Evaluate:
    return replace(Evaluate(Path("x")), **flags)

"""`inhabit teach`: checks and runs its commands."""

import json
from pathlib import Path

import torch

from console.commands.teaching import TeachCarry, TeachRecord, TeachTry
from console.run import assembly
from console.teaching import dagger, recording, trials
from world.errors import ConfigError
from world.tasks.carry import Carry


def teach_command(command: TeachCarry) -> int:
    """Train a student of the scripted teacher."""
    if not command.hidden:
        raise ConfigError("--hidden must be one width or more")
    if command.out.exists() and not (command.out / "manifest.json").exists():
        raise ConfigError(f"{command.out} exists and is not a checkpoint: choose another folder")
    if command.practice.walker is not None:
        _carry_policy(command.practice.walker)
    torch.set_num_threads(1)
    dagger.teach(command)
    return 0


def try_command(command: TeachTry) -> int:
    """Evaluate the scripted teacher and print its figures."""
    if not 0.0 < command.near_m <= command.far_m:
        raise ConfigError("--near-m must be above 0 and no more than --far-m")
    torch.set_num_threads(1)
    figures = trials.evaluate_teacher(command)
    if command.json:
        print(json.dumps(figures, indent=1))
        return 0
    for name in ("success", "sustained", "falls", "time_s", "precision_m"):
        print(name, figures[name])
    for part in figures["by_stage"]:
        print(part)
    return 0


def record_command(command: TeachRecord) -> int:
    """Record clips of the scripted teacher."""
    torch.set_num_threads(1)
    recording.record(command)
    return 0


def _carry_policy(path: Path) -> None:
    found = assembly.trained(path)
    if found.task != Carry.name:
        raise ConfigError(
            f"--walker {path} is a policy of {found.task}: choose one of {Carry.name}"
        )

"""`inhabit teach`: checks and runs its commands."""

import json
import math
from pathlib import Path

import torch

from console.commands.teaching import Practice, TeachCarry, TeachRecord, TeachTry
from console.run import assembly
from console.teaching import dagger, recording, trials
from world.errors import ConfigError


def teach_command(command: TeachCarry) -> int:
    """Train a student of the scripted teacher."""
    _above_zero(command, "minutes", "workers", "batch", "rate", "first", "capacity")
    if command.batches is not None:
        _above_zero(command, "batches")
    if not all(0.0 < steps < math.inf for steps in command.spell):
        raise ConfigError("--spell must be two numbers above 0")
    if not command.hidden or min(command.hidden) <= 0:
        raise ConfigError("--hidden must be widths above 0")
    _check_practice(command.practice)
    if command.out.exists() and not (command.out / "manifest.json").exists():
        raise ConfigError(f"{command.out} exists and is not a checkpoint: choose another folder")
    if command.practice.walker is not None:
        _carry_policy(command.practice.walker)
    torch.set_num_threads(1)
    dagger.teach(command)
    return 0


def try_command(command: TeachTry) -> int:
    """Evaluate the scripted teacher and print its figures."""
    _above_zero(command, "trials", "seconds", "threads")
    if not 0.0 < command.near_m <= command.far_m < math.inf:
        raise ConfigError("--near-m must be above 0 and no more than --far-m")
    _at_least_zero(command, "noise")
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
    _above_zero(command, "clips", "scenes")
    torch.set_num_threads(1)
    recording.record(command)
    return 0


def _check_practice(practice: Practice) -> None:
    _above_zero(practice, "steps", "scenes", "skew")
    _at_least_zero(practice, "noise")
    for name in ("in_hand", "near", "lifted"):
        if not 0.0 <= getattr(practice, name) <= 1.0:
            raise ConfigError(f"{_flag(name)} must be between 0 and 1")


def _carry_policy(path: Path) -> None:
    found = assembly.trained(path)
    if found.task != "carry":
        raise ConfigError(f"--walker {path} is a policy of {found.task}: choose one of carry")


def _above_zero(settings: object, *names: str) -> None:
    for name in names:
        if not 0 < getattr(settings, name) < math.inf:
            raise ConfigError(f"{_flag(name)} must be above 0")


def _at_least_zero(settings: object, *names: str) -> None:
    for name in names:
        if not 0 <= getattr(settings, name) < math.inf:
            raise ConfigError(f"{_flag(name)} must be 0 or above")


def _flag(name: str) -> str:
    return f"--{name.replace('_', '-')}"

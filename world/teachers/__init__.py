"""The teachers, by name. A new one is a file and a line here."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from world.config import WorldConfig
from world.errors import ChoiceError, ConfigError
from world.objects.bank import ObjectBank
from world.teachers.scripted.carry import CarryTeacher
from world.teachers.teacher import Teacher


@dataclass(frozen=True)
class Entry:
    """One teacher: the tasks that it teaches, and its factory."""

    tasks: tuple[str, ...]
    make: Callable[[ObjectBank, Sequence[int]], Teacher]


REGISTRY: dict[str, Entry] = {"carry": Entry(("carry",), CarryTeacher.of_bank)}


def check(config: WorldConfig) -> None:
    """Raise ChoiceError, which lists the names there are, for an unknown teacher; ConfigError where
    it does not teach the task."""
    if config.teacher is None:
        return
    if config.teacher not in REGISTRY:
        raise ChoiceError("--world.teacher", config.teacher, list(REGISTRY))
    if config.task not in REGISTRY[config.teacher].tasks:
        raise ConfigError(
            f"--world.teacher {config.teacher} does not teach the task {config.task}: leave it out"
        )


def make(config: WorldConfig, bank: ObjectBank, scenes: Sequence[int]) -> Teacher | None:
    """The teacher of a world's scenes `scenes` (global ids); None where it has none.
    Raises as `check` does."""
    check(config)
    return None if config.teacher is None else REGISTRY[config.teacher].make(bank, scenes)


__all__ = ["REGISTRY", "Entry", "Teacher", "check", "make"]

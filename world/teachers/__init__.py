"""The teachers, by name. A new one is a file and a line here."""

from collections.abc import Callable

from world.config import WorldConfig
from world.errors import ChoiceError, ConfigError
from world.objects.bank import ObjectBank
from world.teachers.carry import CarryTeacher
from world.teachers.teacher import Teacher


def _carry(bank: ObjectBank, scenes: range) -> Teacher:
    masses = getattr(bank, "mass", None)
    if masses is None:
        raise ConfigError("--world.teacher carry: it teaches the task carry alone")
    return CarryTeacher(masses, scenes)


REGISTRY: dict[str, Callable[[ObjectBank, range], Teacher]] = {"carry": _carry}


def make(config: WorldConfig, bank: ObjectBank, scenes: range) -> Teacher | None:
    """The teacher of a world's scenes `scenes` (a range of global ids); None where it has none.

    ChoiceError lists the names there are; ConfigError where the teacher is for another task.
    """
    if config.teacher is None:
        return None
    if config.teacher not in REGISTRY:
        raise ChoiceError("teacher", config.teacher, list(REGISTRY))
    return REGISTRY[config.teacher](bank, scenes)


__all__ = ["REGISTRY", "Teacher", "make"]

"""The teachers, by name. A new one is a file and a line here."""

from collections.abc import Callable

from world.config import WorldConfig
from world.errors import ChoiceError, ConfigError
from world.objects.box_bank import BoxBank
from world.objects.furniture_bank import Bank
from world.teachers.carry import CarryTeacher
from world.teachers.teacher import Teacher

AnyBank = Bank | BoxBank


def _carry(bank: AnyBank, scenes: range) -> Teacher:
    if not isinstance(bank, BoxBank):
        raise ConfigError("--world.teacher carry: it teaches the task carry alone")
    return CarryTeacher(bank, scenes)


REGISTRY: dict[str, Callable[[AnyBank, range], Teacher]] = {"carry": _carry}


def make(config: WorldConfig, bank: AnyBank, scenes: range) -> Teacher | None:
    """The teacher of a world's scenes `scenes` (a range of global ids); None where it has none.

    ChoiceError lists the names there are; ConfigError where the teacher is for another task.
    """
    if config.teacher is None:
        return None
    if config.teacher not in REGISTRY:
        raise ChoiceError("teacher", config.teacher, list(REGISTRY))
    return REGISTRY[config.teacher](bank, scenes)


__all__ = ["REGISTRY", "Teacher", "make"]

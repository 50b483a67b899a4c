"""The registry of teachers: names, the tasks that each teaches, and none by default."""

import pytest

from world import tasks, teachers
from world.config import CarryConfig, WorldConfig
from world.errors import ChoiceError, ConfigError
from world.objects.box_bank import BoxBank, boxes

BANK = BoxBank(boxes(CarryConfig(sizes=2)))


def test_a_world_has_the_teacher_of_its_setting() -> None:
    assert teachers.make(WorldConfig(task="carry"), BANK, range(4)) is None
    for name, entry in teachers.REGISTRY.items():
        assert set(entry.tasks) <= set(tasks.REGISTRY)
        assert teachers.make(WorldConfig(task=entry.tasks[0], teacher=name), BANK, range(4))


def test_an_unknown_teacher_and_another_task_are_refused() -> None:
    with pytest.raises(ChoiceError, match=r"unknown --world\.teacher 'crab': choose one of carry"):
        teachers.check(WorldConfig(task="carry", teacher="crab"))
    with pytest.raises(ConfigError, match="carry does not teach the task sit: leave it out"):
        teachers.make(WorldConfig(task="sit", teacher="carry"), BANK, range(4))

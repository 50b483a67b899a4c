"""The registry of tasks."""

import pytest

from world import tasks
from world.errors import ChoiceError


def test_names_are_those_of_the_registry() -> None:
    for name, kind in tasks.REGISTRY.items():
        task = tasks.make(name)
        assert isinstance(task, kind) and task.name == name
        assert set(task.terms) and task.success_m > 0.0
        assert tasks.HELD not in task.stages
    with pytest.raises(ChoiceError, match="unknown task 'juggle': choose one of carry, lie, sit"):
        tasks.make("juggle")

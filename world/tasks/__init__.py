"""The tasks, by name. A new one is a file and a line here."""

from world.errors import ChoiceError
from world.tasks.sit import Sit
from world.tasks.task import Place, Task

REGISTRY: dict[str, type[Task]] = {"sit": Sit}


def make(name: str) -> Task:
    """The task called `name`; ChoiceError lists the names there are."""
    if name not in REGISTRY:
        raise ChoiceError("task", name, list(REGISTRY))
    return REGISTRY[name]()


__all__ = ["REGISTRY", "Place", "Task", "make"]

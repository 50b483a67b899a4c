"""The tasks, by name. A new one is a file and a line here."""

from world.errors import ChoiceError
from world.scene.target import Target, state
from world.tasks.carry import Carry
from world.tasks.lie import Lie
from world.tasks.sit import Sit
from world.tasks.task import HELD, Task
from world.tasks.track import Track
from world.tasks.walk import Walk

REGISTRY: dict[str, type[Task]] = {
    "sit": Sit,
    "lie": Lie,
    "carry": Carry,
    "walk": Walk,
    "track": Track,
}


def make(name: str) -> Task:
    """The task called `name`; ChoiceError lists the names there are."""
    if name not in REGISTRY:
        raise ChoiceError("task", name, list(REGISTRY))
    return REGISTRY[name]()


__all__ = ["HELD", "REGISTRY", "Target", "Task", "make", "state"]

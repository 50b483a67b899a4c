"""Every kind of object that a task uses is known to the console."""

from console.kinds import KINDS, kind
from world import tasks


def test_every_task_has_a_kind() -> None:
    assert {tasks.make(name).affordance.kind for name in tasks.REGISTRY} == set(KINDS)
    assert kind(tasks.make("walk")) is KINDS["floor"]

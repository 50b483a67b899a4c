"""Objects in the console: what the player, files and flags must know of each kind of object."""

from console.kinds.box import BoxKind
from console.kinds.floor import FloorKind
from console.kinds.furniture import FurnitureKind
from console.kinds.kind import Kind
from world.tasks import Task

#: By `Affordance.kind`. A new kind is a file and a line here.
KINDS: dict[str, Kind] = {
    "furniture": FurnitureKind(),
    "box": BoxKind(),
    "floor": FloorKind(),
}


def kind(task: Task) -> Kind:
    """The kind of object that a task uses."""
    return KINDS[task.affordance.kind]

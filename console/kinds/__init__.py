"""Kinds of objects (furniture, box, floor) for the player, recordings and flags."""

from console.kinds.box import BoxKind
from console.kinds.floor import FloorKind
from console.kinds.furniture import FurnitureKind
from console.kinds.kind import Kind
from console.kinds.reference import ReferenceKind
from world.tasks import Task

#: Kinds by `Affordance.kind`. A new kind is one file and one line here.
KINDS: dict[str, Kind] = {
    "furniture": FurnitureKind(),
    "box": BoxKind(),
    "floor": FloorKind(),
    "reference": ReferenceKind(),
}


def kind(task: Task) -> Kind:
    """Return the kind of object of a task."""
    return KINDS[task.affordance.kind]

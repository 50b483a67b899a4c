"""Objects in messages: one adapter for each kind of object that a task uses."""

from collections.abc import Sequence

from google.protobuf.message import Message

from policy.errors import RequestError
from policy.objects.adapter import Adapter, Cancelled, Props, not_cancelled
from policy.objects.box import BoxAdapter
from policy.objects.floor import FloorAdapter
from policy.objects.furniture import FurnitureAdapter
from policy.objects.reference import ReferenceAdapter
from rpc.v1 import policy_pb2 as pb
from world.furniture.piece import Piece
from world.scene.model import Ball
from world.tasks import Task

#: Adapters by `Affordance.kind`; a new kind is one file and one line here.
ADAPTERS: dict[str, Adapter] = {
    "furniture": FurnitureAdapter(),
    "box": BoxAdapter(),
    "floor": FloorAdapter(),
    "reference": ReferenceAdapter(),
}


def adapter(task: Task) -> Adapter:
    """Adapter of a task's object."""
    return ADAPTERS[task.affordance.kind]


def require(message: Message, task: Task, name: str = "") -> None:
    """Raise RequestError where a message at the path `name` lacks the task's object."""
    needed = adapter(task).message
    if not message.HasField(needed):
        raise RequestError(f"{name}{needed}: missing, '{task.name}' needs it")


def props_of(
    request: pb.SynthesizeRequest,
    task: Task,
    balls: Sequence[Ball] = (),
    piece: Piece | None = None,
    cancelled: Cancelled = not_cancelled,
) -> Props:
    """Object of a request in its scene.

    balls: projectiles of the scene. piece: furniture, at its scale, used instead of the request's
    shape. cancelled: returns whether the client has cancelled the call.
    Raises RequestError, naming the field, where something is missing or wrong.
    """
    require(request, task)
    return adapter(task).props(request, task, balls, piece, cancelled)

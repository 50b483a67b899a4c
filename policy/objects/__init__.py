"""Objects in messages: an adapter for each kind of object that tasks use."""

from collections.abc import Sequence

from google.protobuf.message import Message

from policy.errors import RequestError
from policy.objects.adapter import Adapter, Cancelled, Props, not_cancelled
from policy.objects.box import BoxAdapter
from policy.objects.floor import FloorAdapter
from policy.objects.furniture import FurnitureAdapter
from rpc.v1 import policy_pb2 as pb
from world.furniture.piece import Piece
from world.scene.model import Ball
from world.tasks import Task

#: By `Affordance.kind`. A new kind is a file and a line here.
ADAPTERS: dict[str, Adapter] = {
    "furniture": FurnitureAdapter(),
    "box": BoxAdapter(),
    "floor": FloorAdapter(),
}


def adapter(task: Task) -> Adapter:
    """The adapter of a task's object."""
    return ADAPTERS[task.affordance.kind]


def require(message: Message, task: Task, name: str = "") -> None:
    """Raise RequestError where a message, called `name`, lacks the task's object."""
    needed = adapter(task).message
    if not message.HasField(needed):
        raise RequestError(f"{name}{needed}: missing, '{task.name}' needs it")


def props_of(
    request: pb.SynthesizeRequest,
    task: Task,
    balls: Sequence[Ball] = (),
    piece: Piece | None = None,
    gone: Cancelled = not_cancelled,
) -> Props:
    """The object of a request; RequestError names what is missing or wrong.

    balls: projectiles that its scene has besides. piece: the furniture, at its scale, in the place
    of the request's shape. gone: whether the client gave up.
    """
    require(request, task)
    return adapter(task).props(request, task, balls, piece, gone)

"""Protocols of the objects of messages: as rows of numbers and as the object of a scene."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Protocol

import mujoco
from torch import Tensor

from policy.errors import RequestError
from policy.fields import Numbers
from rpc.v1 import policy_pb2 as pb
from world.furniture.piece import Box, Piece
from world.scene.batch import Scenes
from world.scene.model import Ball
from world.scene.target import Target
from world.tasks import Task

Cancelled = Callable[[], bool]
"""Returns whether the client has cancelled the call."""


def not_cancelled() -> bool:
    """False: the call cannot be cancelled."""
    return False


@contextmanager
def of_message(name: str) -> Iterator[None]:
    """Within it, an error names the message that the field is of."""
    try:
        yield
    except RequestError as error:
        raise RequestError(f"{name}.{error}") from error


class Props(Protocol):
    """Object of one simulated scene."""

    model: mujoco.MjModel
    """Compiled scene"""

    def begin(self, scenes: Scenes) -> None:
        """Place the object as in the request."""
        ...

    def target(self, scenes: Scenes) -> Target:
        """Target of the task at present."""
        ...

    def move(self, scenes: Scenes, position: Numbers, yaw: float) -> None:
        """Move the furniture, or the box's first stand, to position [3], m, and yaw, rad."""
        ...

    def use_point(self) -> tuple[Tensor, Tensor]:
        """Use point on the floor [1, 2], m, and its heading [1, 2] (cosine, sine); for a box the
        point below its initial position."""
        ...

    def shift(self, scenes: Scenes, point: Tensor, facing: Tensor) -> None:
        """Move the object so that its use point is `point` [1, 2], m, with heading `facing` [1, 2].

        A box on its first stand moves with the stand.
        """
        ...

    def pose(self, scenes: Scenes) -> tuple[list[float], list[float]]:
        """Position [3], m, and rotation [4] of the object in the world frame."""
        ...

    def boxes(self) -> tuple[Box, ...]:
        """Boxes that the object consists of, in its frame."""
        ...


class Adapter(Protocol):
    """Reader of one kind of object in messages."""

    message: str
    """Field of requests and situations that holds the object"""

    def target(self, rows: Tensor) -> Target:
        """Targets of pose rows [n, POSE_WIDTH]."""
        ...

    def fill(self, row: Numbers, message: pb.Situation, task: Task, name: str) -> None:
        """Write the object of a situation into its pose row; RequestError names the field."""
        ...

    def props(
        self,
        request: pb.SynthesizeRequest,
        task: Task,
        balls: Sequence[Ball],
        piece: Piece | None,
        cancelled: Cancelled = not_cancelled,
    ) -> Props:
        """Object of a request in its scene; arguments as in `policy.objects.props_of`."""
        ...

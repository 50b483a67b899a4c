"""What messages say of a kind of object, as rows and as the object of a simulated scene."""

from collections.abc import Callable, Sequence
from typing import Protocol

import mujoco
from torch import Tensor

from policy.fields import Numbers
from rpc.v1 import policy_pb2 as pb
from world.furniture.piece import Box, Piece
from world.scene.batch import Scenes
from world.scene.model import Ball
from world.scene.target import Target
from world.tasks import Task

Cancelled = Callable[[], bool]
"""Whether the client gave up."""


def not_cancelled() -> bool:
    """False: the client waits."""
    return False


class Props(Protocol):
    """The object of one scene."""

    model: mujoco.MjModel

    def begin(self, scenes: Scenes) -> None:
        """Put everything where the request has it."""
        ...

    def target(self, scenes: Scenes) -> Target:
        """What the task must know of it now."""
        ...

    def move(self, scenes: Scenes, position: Numbers, yaw: float) -> None:
        """Put it elsewhere: furniture to position [3] m, or the box's first stand below it."""
        ...

    def spot(self) -> tuple[Tensor, Tensor]:
        """The floor below the place of use, or below the box's first place, [1, 2] m, and where it
        faces [1, 2] (cosine, sine)."""
        ...

    def shift(self, scenes: Scenes, point: Tensor, facing: Tensor) -> None:
        """Put it where its spot is point [1, 2] m and faces facing [1, 2]; a box on its first stand
        goes along with it."""
        ...

    def pose(self, scenes: Scenes) -> tuple[list[float], list[float]]:
        """Position [3] m and rotation [4] of the object, world."""
        ...

    def boxes(self) -> tuple[Box, ...]:
        """What it is made of, in its frame."""
        ...


class Adapter(Protocol):
    """Of one kind of object."""

    message: str
    """The field of requests and situations that holds it."""

    def target(self, rows: Tensor) -> Target:
        """What the task must know of the object, of situations [n, POSE_WIDTH]."""
        ...

    def fill(self, row: Numbers, message: pb.Situation, task: Task, name: str) -> None:
        """Write what a situation says of the object into its row; RequestError names the field."""
        ...

    def props(
        self,
        request: pb.SynthesizeRequest,
        task: Task,
        balls: Sequence[Ball],
        piece: Piece | None,
        gone: Cancelled = not_cancelled,
    ) -> Props:
        """The object of a request; RequestError names what is wrong. balls: projectiles that its
        scene has besides. piece: the furniture, at its scale, in the place of the request's
        shape. gone: whether the client gave up."""
        ...

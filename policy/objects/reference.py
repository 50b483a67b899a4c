"""Reference motions in messages: none, since messages hold no clips."""

from collections.abc import Sequence
from typing import NoReturn

from torch import Tensor

from policy.errors import RequestError
from policy.fields import Numbers
from policy.objects.adapter import Cancelled, not_cancelled
from rpc.v1 import policy_pb2 as pb
from world.furniture.piece import Piece
from world.scene.model import Ball
from world.tasks import Task


class ReferenceAdapter:
    """See Adapter: each request is refused."""

    message = "furniture"

    def target(self, rows: Tensor) -> NoReturn:
        """RequestError."""
        raise RequestError(_refusal("this task"))

    def fill(self, row: Numbers, message: pb.Situation, task: Task, name: str) -> NoReturn:
        """RequestError, which names the field."""
        raise RequestError(f"{name}: {_refusal(task.name)}")

    def props(
        self,
        request: pb.SynthesizeRequest,
        task: Task,
        balls: Sequence[Ball],
        piece: Piece | None,
        cancelled: Cancelled = not_cancelled,
    ) -> NoReturn:
        """RequestError."""
        raise RequestError(_refusal(task.name))


def _refusal(task: str) -> str:
    return f"'{task}' follows clips, which messages cannot hold; choose a policy of another task"

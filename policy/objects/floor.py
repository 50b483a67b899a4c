"""Floor targets in messages: position and rotation of a Furniture without a shape."""

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from policy.errors import RequestError
from policy.fields import Numbers, upright, vector
from policy.objects.adapter import Cancelled, not_cancelled, of_message
from policy.objects.columns import COLUMNS
from rpc.v1 import policy_pb2 as pb
from world.furniture.piece import Box, Piece
from world.objects.floor_bank import MARKER, FloorBank
from world.scene.batch import Scenes
from world.scene.model import Ball
from world.scene.target import Target
from world.tasks import Task

_HERE = torch.zeros(1, dtype=torch.int64)


class FloorAdapter:
    """See Adapter."""

    message = "furniture"

    def target(self, rows: Tensor) -> Target:
        """See Adapter."""
        point, facing = rows[:, COLUMNS["point"]], rows[:, COLUMNS["facing"]]
        return Target(point, facing, point[:, None].expand(-1, 8, -1))

    def fill(self, row: Numbers, message: pb.Situation, task: Task, name: str) -> None:
        """See Adapter."""
        with of_message(name):
            position, yaw = _where(message.furniture)
        row[COLUMNS["point"]] = position[0], position[1], 0.0
        row[COLUMNS["facing"]] = np.cos(yaw), np.sin(yaw)

    def props(
        self,
        request: pb.SynthesizeRequest,
        task: Task,
        balls: Sequence[Ball],
        piece: Piece | None,
        cancelled: Cancelled = not_cancelled,
    ) -> "FloorArrangement":
        """See Adapter."""
        return FloorArrangement(*_where(request.furniture), balls)


def _where(message: pb.Furniture) -> tuple[Numbers, float]:
    """Position [3], m, of the target, and its heading, rad."""
    if message.WhichOneof("shape") is not None:
        raise RequestError(
            "furniture: this task needs no furniture; leave the shape out, position and rotation "
            "are the target's"
        )
    return (
        vector(message.position, "furniture.position", 3),
        upright(message.rotation, "furniture.rotation"),
    )


class FloorArrangement:
    """A target on an empty floor; see Props."""

    def __init__(self, position: Numbers, yaw: float, balls: Sequence[Ball] = ()) -> None:
        self._bank = FloorBank(balls)
        self.model = self._bank.models[0]
        self._set(torch.from_numpy(position[:2]).float()[None], yaw)

    def _set(self, point: Tensor, yaw: float) -> None:
        self._point, self._yaw = point, yaw
        self._facing = torch.tensor([[np.cos(yaw), np.sin(yaw)]], dtype=torch.float32)

    def begin(self, scenes: Scenes) -> None:
        """See Props."""
        scenes.move_furniture(_HERE, *self._bank.placed(self._point, self._facing))

    def target(self, scenes: Scenes) -> Target:
        """See Props."""
        return self._bank.target(self._point, self._facing)

    def move(self, scenes: Scenes, position: Numbers, yaw: float) -> None:
        """See Props."""
        self._set(torch.from_numpy(position[:2]).float()[None], yaw)
        self.begin(scenes)

    def use_point(self) -> tuple[Tensor, Tensor]:
        """See Props."""
        return self._point, self._facing

    def shift(self, scenes: Scenes, point: Tensor, facing: Tensor) -> None:
        """See Props."""
        cos, sin = facing[0].tolist()
        self._set(point, float(np.arctan2(sin, cos)))
        self.begin(scenes)

    def pose(self, scenes: Scenes) -> tuple[list[float], list[float]]:
        """See Props."""
        x, y = self._point[0].tolist()
        return [x, y, 0.0], [float(np.cos(self._yaw / 2)), 0.0, 0.0, float(np.sin(self._yaw / 2))]

    def boxes(self) -> tuple[Box, ...]:
        """Boxes of the marker."""
        return MARKER.boxes

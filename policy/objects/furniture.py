"""Furniture in messages: a piece of the catalogue, a custom shape or a mesh."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from policy.errors import RequestError
from policy.fields import Numbers, number
from policy.objects.adapter import Cancelled, not_cancelled, of_message
from policy.objects.columns import COLUMNS, POSE_WIDTH
from policy.objects.placement import (
    SCALES,
    PlacedFurniture,
    fill_target,
    mesh_use_point,
    place,
    placed_furniture,
    turned,
)
from rpc.v1 import policy_pb2 as pb
from world.furniture.piece import Box, Piece
from world.meshes import importing
from world.meshes.build import ImportOptions
from world.scene.batch import Scenes
from world.scene.model import Ball, compile_scene
from world.scene.target import Target
from world.tasks import Task

_HERE = torch.zeros(1, dtype=torch.int64)
#: Mesh formats that consist of one file.
FORMATS = ("obj", "stl", "ply", "glb")


def piece_of_mesh(furniture: pb.Furniture, cancelled: Cancelled = not_cancelled) -> Piece:
    """Piece of a mesh, decomposed in a bounded process of its own or read from the cache.

    Raises RequestError where the mesh is refused.
    """
    mesh = furniture.mesh
    if mesh.format not in FORMATS:
        raise RequestError(
            f"furniture.mesh.format: '{mesh.format}', must be one of {', '.join(FORMATS)}"
        )
    scale = number(furniture.scale if furniture.HasField("scale") else 1.0, "scale", *SCALES)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"mesh.{mesh.format}"
        path.write_bytes(mesh.data)
        (outcome,) = importing.run(importing.jobs([path], ImportOptions()), 1, stopped=cancelled)
    piece = outcome.piece()
    if piece is None:
        raise RequestError(f"furniture.mesh: {outcome.refused}")
    return piece.scaled(scale)


class FurnitureAdapter:
    """See Adapter."""

    message = "furniture"

    def target(self, rows: Tensor) -> Target:
        """See Adapter."""
        return target_of(rows)

    def fill(self, row: Numbers, message: pb.Situation, task: Task, name: str) -> None:
        """See Adapter."""
        with of_message(name):
            fill_target(row, placed_furniture(message.furniture, task))

    def props(
        self,
        request: pb.SynthesizeRequest,
        task: Task,
        balls: Sequence[Ball],
        piece: Piece | None,
        cancelled: Cancelled = not_cancelled,
    ) -> "FurnitureArrangement":
        """See Adapter."""
        if piece is None and request.furniture.WhichOneof("shape") == "mesh":
            piece = piece_of_mesh(request.furniture, cancelled)
        if piece is not None:
            where = place(
                request.furniture, piece, mesh_use_point(piece, request.furniture, task), True
            )
        else:
            where = placed_furniture(request.furniture, task, anywhere=True)
        return FurnitureArrangement(where, balls)


def target_of(rows: Tensor) -> Target:
    """Targets of pose rows [n, POSE_WIDTH]."""
    corners = rows[:, COLUMNS["corners"]].unflatten(1, (8, 3))
    point, facing, head = (rows[:, COLUMNS[name]] for name in ("point", "facing", "head"))
    return Target(point, facing, corners, head)


class FurnitureArrangement:
    """Furniture to sit or lie on."""

    def __init__(self, where: PlacedFurniture, balls: Sequence[Ball] = ()) -> None:
        self._where = where
        self._row = torch.zeros(1, POSE_WIDTH)
        try:
            self.model = compile_scene(where.piece, balls)
        except ValueError as error:  # MuJoCo's error for a model that it does not compile
            raise RequestError(f"furniture: cannot be simulated: {error}") from error

    def begin(self, scenes: Scenes) -> None:
        """See Props."""
        self.move(scenes, self._where.position, self._where.yaw)

    def target(self, scenes: Scenes) -> Target:
        """See Props."""
        return target_of(self._row)

    def move(self, scenes: Scenes, position: Numbers, yaw: float) -> None:
        """See Props."""
        self._where = self._where.moved(position, yaw)
        row = np.zeros(POSE_WIDTH)
        fill_target(row, self._where)
        self._row = torch.from_numpy(row).float()[None]
        turned = torch.tensor([[np.cos(yaw), np.sin(yaw)]])
        scenes.move_furniture(_HERE, torch.from_numpy(position)[None], turned)

    def use_point(self) -> tuple[Tensor, Tensor]:
        """See Props."""
        heading = self._where.yaw + self._where.use_point.facing_rad
        point = self._where.position + turned(self._where.use_point.point_m, self._where.yaw)
        facing = torch.tensor([[np.cos(heading), np.sin(heading)]], dtype=torch.float32)
        return torch.from_numpy(point[:2]).float()[None], facing

    def shift(self, scenes: Scenes, point: Tensor, facing: Tensor) -> None:
        """See Props."""
        cos, sin = facing[0].double().tolist()
        yaw = float(np.arctan2(sin, cos)) - self._where.use_point.facing_rad
        origin = np.append(point[0].double().numpy(), 0.0)
        origin = origin - turned(self._where.use_point.point_m, yaw)
        origin[2] = self._where.position[2]
        self.move(scenes, origin, yaw)

    def pose(self, scenes: Scenes) -> tuple[list[float], list[float]]:
        """See Props."""
        half = 0.5 * self._where.yaw
        rotation = [float(np.cos(half)), 0.0, 0.0, float(np.sin(half))]
        return self._where.position.tolist(), rotation

    def boxes(self) -> tuple[Box, ...]:
        """See Props."""
        return self._where.piece.boxes

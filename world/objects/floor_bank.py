"""A bank with the one scene that holds nothing but a floor: its place of use is any point of it."""

from collections.abc import Sequence

import mujoco
import torch
from torch import Tensor

from world.furniture.piece import Box, Piece
from world.scene.model import Ball, compile_scene
from world.scene.target import Target

#: What a recording shows at the target: a plate with a bar ahead of it. Nothing collides with it.
MARKER = Piece(
    "floor",
    "floor",
    (
        Box((0.0, 0.0, 0.001), (0.2, 0.2, 0.001)),
        Box((0.3, 0.0, 0.001), (0.1, 0.04, 0.001)),
    ),
    (),
    1.0,
)


class FloorBank:
    """The empty scene, as a bank of one variant."""

    def __init__(self, balls: Sequence[Ball] = (), count: int = 1) -> None:
        """balls: projectiles that every scene has. count: how often the one model is listed."""
        self.pieces = (MARKER,) * count
        model = compile_scene(None, balls)
        self.models: list[mujoco.MjModel] = [model] * count

    def __len__(self) -> int:
        return len(self.models)

    @staticmethod
    def placed(point: Tensor, facing: Tensor) -> tuple[Tensor, Tensor]:
        """Origin [m, 3] (m) and yaw (cosine, sine) [m, 2] of the parked furniture body, which marks
        the target in recordings: point [m, 2], facing [m, 2]."""
        return torch.cat((point, torch.zeros_like(point[:, :1])), dim=1), facing

    @staticmethod
    def target(point: Tensor, facing: Tensor) -> Target:
        """What the task knows of points [m, 2] with their facings [m, 2]."""
        at, _ = FloorBank.placed(point, facing)
        return Target(at, facing, at[:, None].expand(-1, 8, -1).clone())

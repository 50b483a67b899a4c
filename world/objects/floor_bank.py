"""A bank with one scene, an empty floor; the use point is any point of it."""

from collections.abc import Sequence

import mujoco
import torch
from torch import Tensor

from world.furniture.piece import Box, Piece
from world.scene.batch import Scenes
from world.scene.model import Ball, compile_scene
from world.scene.target import Target

#: Marker of the target in recordings: a plate with a bar ahead of it. It does not collide.
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
    """The empty scene as a bank of one variant; an ObjectBank."""

    def __init__(self, balls: Sequence[Ball] = (), count: int = 1) -> None:
        """balls: projectiles of every scene; count: repetitions of the model."""
        self.pieces = (MARKER,) * count
        model = compile_scene(None, balls)
        self.models: list[mujoco.MjModel] = [model] * count

    def __len__(self) -> int:
        return len(self.models)

    @staticmethod
    def placed(point: Tensor, facing: Tensor) -> tuple[Tensor, Tensor]:
        """Origin [m, 3] (m) and yaw (cosine, sine) [m, 2] of the unused furniture body, which marks
        the target point [m, 2] and facing [m, 2] in recordings."""
        return torch.cat((point, torch.zeros_like(point[:, :1])), dim=1), facing

    @staticmethod
    def target(point: Tensor, facing: Tensor) -> Target:
        """Targets at points [m, 2] m with facings [m, 2] (cosine, sine)."""
        at, _ = FloorBank.placed(point, facing)
        return Target(at, facing, at[:, None].expand(-1, 8, -1).clone())

    def move(
        self,
        scenes: Scenes,
        ids: Tensor,
        variant: Tensor,
        target: Target,
        point: Tensor,
        facing: Tensor,
    ) -> Target:
        """See MovableBank: moves the point of the floor and its marker."""
        scenes.move_furniture(ids, *self.placed(point, facing))
        return self.target(point, facing)

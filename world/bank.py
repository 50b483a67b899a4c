"""A bank of compiled scenes: every piece of furniture in several sizes, ready to be swapped into a
shard."""

from collections.abc import Sequence

import mujoco
import numpy as np
import torch
from torch import Tensor

from world import rotations
from world.errors import PieceError
from world.furniture.piece import Piece
from world.scene import compile_scene


class Bank:
    """V variants (a piece at a size each): their models, and what the tasks know of them as
    tensors."""

    def __init__(self, variants: Sequence[Piece]) -> None:
        if not variants:
            raise PieceError("no furniture: choose at least one piece")
        for piece in variants:
            if not piece.sit:
                raise PieceError(f"{piece.name}: has no place to sit")
        self.pieces = tuple(variants)
        self.models: list[mujoco.MjModel] = [compile_scene(piece) for piece in variants]
        self.point = torch.tensor([p.sit[0].point_m for p in variants], dtype=torch.float32)
        yaw = torch.tensor([p.sit[0].facing_rad for p in variants], dtype=torch.float32)
        self.facing = torch.stack((torch.cos(yaw), torch.sin(yaw)), dim=1)
        self.corners = torch.stack(
            [torch.from_numpy(p.corners()).to(torch.float32) for p in variants]
        )
        padded = [piece.boxes_padded() for piece in variants]
        stacked = [torch.from_numpy(np.stack(rows)) for rows in zip(*padded, strict=True)]
        #: Collision boxes in the pieces' frames: centres and half sizes [V, S, 3] m, rotations
        #: [V, S, 3, 3], and which slots are used [V, S].
        self.box_centre, self.box_half, quat = (rows.to(torch.float32) for rows in stacked[:3])
        self.box_rotation = rotations.matrix(quat)
        self.box_used = stacked[3]
        self._by_height = torch.argsort(self.point[:, 2])

    def __len__(self) -> int:
        return len(self.models)

    def of_height(self, height_m: Tensor, u: Tensor) -> Tensor:
        """Variants whose seat is about `height_m` high: one of the nearest twelfth, by u in [0, 1);
        [n]."""
        order = self._by_height
        window = max(1, len(order) // 12)
        at = torch.searchsorted(self.point[order, 2].contiguous(), height_m.contiguous())
        first = (at - window // 2).clamp(0, len(order) - window)
        return order[first + (u * window).long().clamp_max(window - 1)]


#: The highest seat that the character can get onto with its hip standing at 0.89 m, m: pieces that
#: a scale would make higher stop growing there.
MAX_SEAT_M = 0.70


def scaled(piece: Piece, scale: float) -> Piece:
    """The piece at `scale`, or as much smaller as keeps its seat within MAX_SEAT_M."""
    return piece.scaled(min(scale, MAX_SEAT_M / piece.sit[0].point_m[2]))


def variants(pieces: Sequence[Piece], sizes: int, scale: tuple[float, float]) -> list[Piece]:
    """Each piece at `sizes` scales: one from each of as many equal bands of `scale`, shifted by
    piece.

    The golden-ratio shift spreads the scales of all pieces evenly, so that no size is left out.
    """
    low, high = scale
    result = []
    for index, piece in enumerate(pieces):
        shift = (index * 0.6180339887498949) % 1.0
        for band in range(sizes):
            result.append(scaled(piece, low + (high - low) * (band + shift) / sizes))
    return result

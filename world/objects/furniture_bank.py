"""A bank of compiled scenes: every piece of furniture in several sizes, ready to be swapped into a
shard."""

from collections.abc import Sequence

import mujoco
import numpy as np
import torch
from torch import Tensor

from world import rotations
from world.errors import PieceError
from world.furniture.piece import TEST_SCALES, Piece
from world.furniture.usage import usage, use_points
from world.scene import slots
from world.scene.model import Ball, compile_scene
from world.scene.target import Target


class FurnitureBank:
    """V variants (a piece at a size each): their models, and what the tasks know of them as
    tensors."""

    def __init__(
        self,
        variants: Sequence[Piece],
        affordance: str = "sit",
        balls: Sequence[Ball] = (),
    ) -> None:
        """Raises PieceError where there is no piece, or one without the affordance asked for.

        balls: projectiles that every scene has beside its piece.
        """
        if not variants:
            raise PieceError("no furniture: choose at least one piece")
        self.affordance = affordance
        # a piece with two sides is used from both in turn
        places = [use_points(piece, affordance) for piece in variants]
        chosen = [found[i % len(found)] for i, found in enumerate(places)]
        self.pieces = tuple(variants)
        shared = slots.common(variants)
        self.models: list[mujoco.MjModel] = [
            compile_scene(piece, balls, shared=shared) for piece in variants
        ]
        #: The place of use, in the piece's frame: the point below the pelvis [V, 3] m, where its
        #: user faces [V, 2] (cosine, sine), and the point below the head [V, 3] m (of a seat, the
        #: point itself).
        self.point = torch.tensor([s.point_m for s in chosen], dtype=torch.float32)
        yaw = torch.tensor([s.facing_rad for s in chosen], dtype=torch.float32)
        self.facing = torch.stack((torch.cos(yaw), torch.sin(yaw)), dim=1)
        self.head = torch.tensor([s.head_m for s in chosen], dtype=torch.float32)
        self.corners = torch.stack(
            [
                torch.from_numpy(spot.corners(piece)).to(torch.float32)
                for piece, spot in zip(variants, chosen, strict=True)
            ]
        )
        padded = [piece.boxes_padded(shared.slots) for piece in variants]
        stacked = [torch.from_numpy(np.stack(rows)) for rows in zip(*padded, strict=True)]
        #: Collision boxes in the pieces' frames: centres and half sizes [V, S, 3] m, rotations
        #: [V, S, 3, 3], and which slots are used [V, S].
        self.box_centre, self.box_half, quat = (rows.to(torch.float32) for rows in stacked[:3])
        self.box_rotation = rotations.matrix(quat)
        self.box_used = stacked[3]
        ends = rotations.turn_back(
            self.facing[:, None], self.corners[..., :2] - self.point[:, None, :2]
        )
        #: The footprint in the frame of the place (+x where its user faces), [V, 2] each, m.
        self.low, self.high = ends.amin(dim=1), ends.amax(dim=1)
        # a bed reaches far beyond the place of use; of a seat that does not matter
        self._wide = usage(affordance).wide
        along = rotations.turn_back(self.facing, (self.head - self.point)[:, :2])
        left = along[:, 1] > 0.0
        by_height = torch.argsort(self.point[:, 2])
        # variants by height: those whose head end is on the right, or that have none; on the left
        self._by_height = tuple(
            part if len(part) else by_height
            for part in (by_height[~left[by_height]], by_height[left[by_height]])
        )

    def __len__(self) -> int:
        return len(self.models)

    def placed(self, variant: Tensor, point: Tensor, facing: Tensor) -> tuple[Tensor, Tensor]:
        """Origin [m, 3] (m) and yaw (cosine, sine) [m, 2] of pieces `variant` [m] whose place is
        above the floor point [m, 2] and faces `facing` [m, 2]."""
        yaw = rotations.turn(self.facing[variant] * self.facing.new_tensor((1.0, -1.0)), facing)
        origin = point - rotations.turn(yaw, self.point[variant, :2])
        return torch.cat((origin, torch.zeros_like(origin[:, :1])), dim=1), yaw

    def target(self, variant: Tensor, point: Tensor, facing: Tensor) -> Target:
        """What the task knows of pieces that stand so; arguments as of `placed`."""
        origin, yaw = self.placed(variant, point, facing)
        corners = rotations.turn(yaw[:, None], self.corners[variant]) + origin[:, None]
        return Target(
            torch.cat((point, self.point[variant, 2:]), dim=1),
            facing,
            corners,
            rotations.turn(yaw, self.head[variant]) + origin,
        )

    def of_height(self, height_m: Tensor, u: Tensor, left: Tensor | None = None) -> Tensor:
        """Variants whose surface is about `height_m` high: one of the nearest twelfth, by u in
        [0, 1); [n].

        left [n] bool: of beds, those whose head is to the left of the side got onto by.
        """

        def nearest(order: Tensor) -> Tensor:
            window = max(1, len(order) // 12)
            at = torch.searchsorted(self.point[order, 2].contiguous(), height_m.contiguous())
            first = (at - window // 2).clamp(0, len(order) - window)
            return order[first + (u * window).long().clamp_max(window - 1)]

        right_order, left_order = self._by_height
        found = nearest(right_order)
        return found if left is None else torch.where(left, nearest(left_order), found)

    def lift(self, variant: Tensor, root_m: Tensor, height_m: Tensor, raised: Tensor) -> Tensor:
        """How much higher a character with its root at root_m [m], on a bed height_m [m] high, is
        on the bed `variant` [m], m: 0 once it stands. On seats, which are chosen by height, 0 but
        for those `raised` [m] bool, which are only ever lifted up."""
        down = ((_STANDS_M - root_m) / 0.15).clamp(0.0, 1.0)
        lift = down * (self.point[variant, 2] - height_m)
        if self._wide:
            return lift
        return torch.where(raised, lift.clamp_min(0.0), 0.0)

    def sunk(self, depth: Tensor, root_m: Tensor, tolerated_m: float) -> Tensor:
        """How much higher still one who lies `depth` [m] deep in a bed is set down, m: [m]; 0 on
        seats, and once the root, root_m [m] high, is up."""
        if not self._wide:
            return torch.zeros_like(depth)
        down = ((_STANDS_M - root_m) / 0.15).clamp(0.0, 1.0)
        return down * (depth - tolerated_m).clamp(0.0, _SUNK_M)

    def clear_of(self, variant: Tensor, offset: Tensor, facing: Tensor, before: Tensor) -> Tensor:
        """Offsets [m, 2] from a standing character to the places, longer where it would else stand
        in a bed; those of seats as they are.

        Args: variant [m]; facing [m, 2] of the places; before [m] bool: counted from the edge that
        is got onto by instead of from the place.
        """
        if not self._wide:
            return offset
        low, high = self.low[variant] - _CLEAR_M, self.high[variant] + _CLEAR_M
        root = rotations.turn_back(facing, -offset)
        to_edge = torch.stack((self.high[variant, 0], torch.zeros_like(root[:, 0])), dim=1)
        root = torch.where(before[:, None], root + to_edge, root)
        # how often the way from the place to the root fits in before it leaves the footprint
        room = torch.where(root > 0.0, high, -low) / root.abs().clamp_min(1e-6)
        pushed = root * room.amin(dim=1, keepdim=True).clamp_min(1.0)
        return -rotations.turn(facing, torch.where(before[:, None], root, pushed))

    def beyond(self, variant: Tensor, root: Tensor, point: Tensor, facing: Tensor) -> Tensor:
        """How far roots [m, 2] are beyond the edges of beds whose places are above the floor points
        [m, 2] and face `facing` [m, 2], m, negative within: [m]; −inf for seats."""
        if not self._wide:
            return torch.full_like(root[:, 0], -torch.inf)
        here = rotations.turn_back(facing, root - point)
        outside = torch.maximum(self.low[variant] - here, here - self.high[variant])
        return outside.amax(dim=1)


#: The most that one who lies is lifted out of a bed, m.
_SUNK_M = 0.12
#: Root height from which a character stands on its feet, m.
_STANDS_M = 0.75
#: How far from a bed's footprint a character is set down, m.
_CLEAR_M = 0.35
#: The highest seat that the character can get onto with its hip standing at 0.89 m, m: pieces that
#: a scale would make higher stop growing there.
MAX_SEAT_M = 0.70


def scaled(piece: Piece, scale: float) -> Piece:
    """The piece at `scale`, or as much smaller as keeps its seat within MAX_SEAT_M; at the nearest
    scale at which a ragdoll rests on its seat, where at the one tried next to this none does."""
    heights = [target.point_m[2] for target in piece.sit[:1]]
    heights = heights or ([piece.lie.hip_m[2]] if piece.lie else [])
    fitting = min([scale, *(MAX_SEAT_M / height for height in heights)])
    return piece.scaled(_holding(piece, fitting))


def _holding(piece: Piece, scale: float) -> float:
    """The scale, moved to one that holds a ragdoll on the first seat where its import saw that it
    does not, as far as one does that is no higher than MAX_SEAT_M."""
    for target in piece.sit[:1]:
        if target.rests_at is None:
            continue
        tried = min(TEST_SCALES, key=lambda at: abs(at - scale))
        fit = [at for at in target.rests_at if at * target.point_m[2] <= MAX_SEAT_M]
        if fit and tried not in target.rests_at:
            return min(fit, key=lambda at: abs(at - scale))
    return scale


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

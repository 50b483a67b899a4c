"""A bank of scenes with furniture: every piece in several sizes, compiled."""

from collections.abc import Sequence

import mujoco
import numpy as np
import torch
from torch import Tensor

from world import rotations
from world.errors import PieceError
from world.furniture.piece import TEST_SCALES, Piece
from world.furniture.usage import usage, use_points
from world.objects.footprint import Footprint
from world.scene import slots
from world.scene.batch import Scenes
from world.scene.model import Ball, compile_scene
from world.scene.target import Target


class FurnitureBank:
    """V variants, each a piece at a size, with models and geometry as tensors; an ObjectBank."""

    def __init__(
        self,
        variants: Sequence[Piece],
        affordance: str = "sit",
        balls: Sequence[Ball] = (),
    ) -> None:
        """balls: projectiles of every scene.

        Raises PieceError without pieces, and for a piece without the affordance.
        """
        if not variants:
            raise PieceError("no furniture: choose at least one piece")
        self.affordance = affordance
        # a piece with two use points has them in turn
        offered = [use_points(piece, affordance) for piece in variants]
        chosen = [found[i % len(found)] for i, found in enumerate(offered)]
        self.pieces = tuple(variants)
        shared = slots.common(variants)
        self.models: list[mujoco.MjModel] = [
            compile_scene(piece, balls, shared=shared) for piece in variants
        ]
        #: The use points, in the pieces' frames: the point below the pelvis [V, 3] m, the facing
        #: [V, 2] (cosine, sine), and the point below the head [V, 3] m (of a seat, the same point).
        self.point = torch.tensor([s.point_m for s in chosen], dtype=torch.float32)
        yaw = torch.tensor([s.facing_rad for s in chosen], dtype=torch.float32)
        self.facing = torch.stack((torch.cos(yaw), torch.sin(yaw)), dim=1)
        self.head = torch.tensor([s.head_m for s in chosen], dtype=torch.float32)
        self.corners = torch.stack(
            [
                torch.from_numpy(use.corners(piece)).to(torch.float32)
                for piece, use in zip(variants, chosen, strict=True)
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
        #: The footprints in the frame of the use point (+x along its facing).
        self.ground = Footprint.of(ends)
        #: Of these, [V, 2] each, m.
        self.low, self.high = self.ground.low, self.ground.high
        reach = torch.maximum(-self.low.amin(dim=1), self.high.amax(dim=1))
        # seats whose furniture is larger than the nearest initial states are distant: sofas, beds
        self._large = reach > _LARGE_M
        # whether the footprint extends far beyond the use point, as a bed's does
        self._wide = usage(affordance).wide
        along = rotations.turn_back(self.facing, (self.head - self.point)[:, :2])
        left = along[:, 1] > 0.0
        by_height = torch.argsort(self.point[:, 2])
        # variants by height: first those with the head on the right or without one, then on the
        # left
        self._by_height = tuple(
            part if len(part) else by_height
            for part in (by_height[~left[by_height]], by_height[left[by_height]])
        )

    def __len__(self) -> int:
        return len(self.models)

    def placed(self, variant: Tensor, point: Tensor, facing: Tensor) -> tuple[Tensor, Tensor]:
        """Origin [m, 3] (m) and yaw (cosine, sine) [m, 2] of pieces `variant` [m] whose use point
        is above the floor point [m, 2] with the facing [m, 2]."""
        yaw = rotations.turn(self.facing[variant] * self.facing.new_tensor((1.0, -1.0)), facing)
        origin = point - rotations.turn(yaw, self.point[variant, :2])
        return torch.cat((origin, torch.zeros_like(origin[:, :1])), dim=1), yaw

    def target(self, variant: Tensor, point: Tensor, facing: Tensor) -> Target:
        """Targets of pieces that are placed so; arguments as of `placed`."""
        origin, yaw = self.placed(variant, point, facing)
        corners = rotations.turn(yaw[:, None], self.corners[variant]) + origin[:, None]
        return Target(
            torch.cat((point, self.point[variant, 2:]), dim=1),
            facing,
            corners,
            rotations.turn(yaw, self.head[variant]) + origin,
        )

    def move(
        self,
        scenes: Scenes,
        ids: Tensor,
        variant: Tensor,
        target: Target,
        point: Tensor,
        facing: Tensor,
    ) -> Target:
        """See MovableBank: the use point comes to be above the floor point."""
        scenes.move_furniture(ids, *self.placed(variant, point, facing))
        return self.target(variant, point, facing)

    def of_height(self, height_m: Tensor, u: Tensor, left: Tensor | None = None) -> Tensor:
        """Variants [n] whose surface is about height_m [n] high: one of the nearest twelfth, chosen
        by u [n] in [0, 1).

        left [n] bool: of beds, those whose head is to the left of the access side.
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
        """Lift [m], m, of a character with its root root_m [m] high from a bed height_m [m] high
        onto the bed `variant` [m]: 0 where it stands. On seats, which are chosen by height, 0
        except for those `raised` [m] bool, where it is never negative."""
        down = ((_STANDS_M - root_m) / 0.15).clamp(0.0, 1.0)
        lift = down * (self.point[variant, 2] - height_m)
        if self._wide:
            return lift
        return torch.where(raised, lift.clamp_min(0.0), 0.0)

    def sunk(self, depth: Tensor, root_m: Tensor, tolerated_m: float) -> Tensor:
        """Additional lift [m], m, of a character that penetrates a bed by depth [m] m; 0 on seats,
        and where the root, root_m [m] high, is up."""
        if not self._wide:
            return torch.zeros_like(depth)
        down = ((_STANDS_M - root_m) / 0.15).clamp(0.0, 1.0)
        return down * (depth - tolerated_m).clamp(0.0, _SUNK_M)

    def clear_of(self, variant: Tensor, offset: Tensor, facing: Tensor, before: Tensor) -> Tensor:
        """Offsets [m, 2] from a standing character to the use points, lengthened where it would
        stand in a bed or, to sit, in a large piece; those of other seats are unchanged.

        Args: variant [m]; facing [m, 2] of the use points; before [m] bool: the offset is from the
        edge of the access side instead of the use point; of seats, it stays as it is.
        """
        if not self._wide and not bool(self._large.any()):
            return offset
        low, high = self.low[variant] - _CLEAR_M, self.high[variant] + _CLEAR_M
        root = rotations.turn_back(facing, -offset)
        if self._wide:
            edge, aside = self.ground.edge[variant], self.ground.aside[variant]
            # in a notch a standing character has room ahead, little to the sides
            straight = torch.where(aside != 0.0, _NARROW, 1.0)
            there = torch.stack((root[:, 0] + edge, root[:, 1] * straight + aside), dim=1)
            root = torch.where(before[:, None], there, root)
        # factor of the vector from the use point to the root at which it leaves the footprint
        room = torch.where(root > 0.0, high, -low) / root.abs().clamp_min(1e-6)
        pushed = root * room.amin(dim=1, keepdim=True).clamp_min(1.0)
        if not self._wide:
            kept = before | ~self._large[variant]
            return torch.where(kept[:, None], offset, -rotations.turn(facing, pushed))
        return -rotations.turn(facing, torch.where(before[:, None], root, pushed))

    def beyond(self, variant: Tensor, root: Tensor, point: Tensor, facing: Tensor) -> Tensor:
        """Distance [m], m, of roots [m, 2] beyond the edges of beds whose use points are above the
        floor points [m, 2] with facings [m, 2]; negative within; −inf for seats."""
        if not self._wide:
            return torch.full_like(root[:, 0], -torch.inf)
        here = rotations.turn_back(facing, root - point)
        outside = torch.maximum(self.low[variant] - here, here - self.high[variant])
        return outside.amax(dim=1)


#: Greatest additional lift of a lying character out of a bed, m.
_SUNK_M = 0.12
#: Root height from which a character stands on its feet, m.
_STANDS_M = 0.75
#: Distance from the use point to the farthest edge beyond which a seat's furniture is large, m;
#: chairs, armchairs and stools reach 0.54.
_LARGE_M = 0.75
#: Least distance of a standing character from a bed's footprint, m.
_CLEAR_M = 0.35
#: Of the sideways distances of initial states in a notch: fraction that stays.
_NARROW = 0.1
#: Greatest height of a seat that the character, with its hip at 0.89 m, can get onto, m; the scale
#: of pieces is limited to it.
MAX_SEAT_M = 0.70


def scaled(piece: Piece, scale: float) -> Piece:
    """The piece at `scale`, reduced so that its seat is within MAX_SEAT_M. Where a ragdoll does not
    rest on its seat at the nearest tested scale, the nearest one at which it does is used."""
    heights = [target.point_m[2] for target in piece.sit[:1]]
    heights = heights or ([piece.lie.hip_m[2]] if piece.lie else [])
    fitting = min([scale, *(MAX_SEAT_M / height for height in heights)])
    return piece.scaled(_holding(piece, fitting))


def _holding(piece: Piece, scale: float) -> float:
    """The scale, replaced by the nearest tested one at which a ragdoll rests on the first seat
    where it does not at this one; only scales with a seat within MAX_SEAT_M are used."""
    for target in piece.sit[:1]:
        if target.rests_at is None:
            continue
        tried = min(TEST_SCALES, key=lambda at: abs(at - scale))
        fit = [at for at in target.rests_at if at * target.point_m[2] <= MAX_SEAT_M]
        if fit and tried not in target.rests_at:
            return min(fit, key=lambda at: abs(at - scale))
    return scale


def variants(pieces: Sequence[Piece], sizes: int, scale: tuple[float, float]) -> list[Piece]:
    """Each piece at `sizes` scales, one from each of as many equal bands of `scale`.

    A shift by the golden ratio from piece to piece spreads the scales of all pieces evenly.
    """
    low, high = scale
    result = []
    for index, piece in enumerate(pieces):
        shift = (index * 0.6180339887498949) % 1.0
        for band in range(sizes):
            result.append(scaled(piece, low + (high - low) * (band + shift) / sizes))
    return result

"""What furniture is used for: to sit or to lie, where on a piece, and which classes offer it."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from world.errors import ChoiceError, PieceError
from world.furniture.piece import Piece, Vector

#: A seat this square to the line from hip to head is on a side that one can get onto the bed by.
_SQUARE_RAD = math.radians(30.0)
#: A side whose edge is this much farther from the hip than the other's is the far side of a double
#: bed: nobody gets to his place across the other half, m.
_ACROSS_M = 0.3


@dataclass(frozen=True)
class UsePoint:
    """One place of use, in the piece's frame."""

    point_m: Vector
    """Below the pelvis, on the surface."""
    head_m: Vector
    """Below the head, on the surface; of a seat, the point itself."""
    facing_rad: float
    """Where its user faces: of a lying place, the side that it is got onto by."""

    def corners(self, piece: Piece) -> NDArray[np.float64]:
        """The corners of the piece's bounding box [8, 3], m, piece frame, in the place's order: by
        x (where it faces, to the nearest quarter turn), then y, then z, low first.

        A piece got onto by its other side is then the same to a policy, as it should be: in the
        piece's own order a table that had been lain on in 80 of 100 trials was in 1.
        """
        quarter = round(self.facing_rad / (math.pi / 2)) % 4
        corners = piece.corners()
        # to be compared, not measured with: which corner is high on which axis
        x, y, z = (corners > corners.mean(axis=0)).T * 2 - 1
        for _ in range(quarter):
            x, y = y, -x
        return corners[np.lexsort((z, y, x))]


@dataclass(frozen=True)
class Usage:
    """One way to use furniture."""

    name: str
    """A verb; pieces are asked for by it, as in `catalogue(affordance=...)`."""
    classes: tuple[str, ...]
    """Classes of the catalogue of which (nearly) every piece offers it."""
    use_points: Callable[[Piece], tuple[UsePoint, ...]]
    """The points of use of a piece; none where it does not offer it."""
    wide: bool
    """Whether the furniture reaches so far beyond the point of use that a character must be kept
    off its whole footprint."""


def usage(name: str) -> Usage:
    """The usage of this name; ChoiceError lists the names."""
    if name not in USAGES:
        raise ChoiceError("affordance", name, list(USAGES))
    return USAGES[name]


def use_points(piece: Piece, affordance: str) -> tuple[UsePoint, ...]:
    """The places of use of a piece: its first seat, or its lying place once for each side that it
    can be got onto by. PieceError where it has none."""
    found = usage(affordance).use_points(piece)
    if not found:
        raise PieceError(f"{piece.name}: has no place to {affordance}")
    return found


def _seat(piece: Piece) -> tuple[UsePoint, ...]:
    return tuple(UsePoint(p.point_m, p.point_m, p.facing_rad) for p in piece.sit[:1])


def _lying(piece: Piece) -> tuple[UsePoint, ...]:
    lie = piece.lie
    if lie is None:
        return ()
    along = math.atan2(lie.head_m[1] - lie.hip_m[1], lie.head_m[0] - lie.hip_m[0])
    both = (along + math.pi / 2, along - math.pi / 2)
    reach = {side: _reach_m(piece, lie.hip_m, side) for side in both}
    nearest = min(reach.values())
    # a lying place without seats, as on a table: both sides are open
    sides = [side for side in both if not reach[side] > nearest + _ACROSS_M]
    return tuple(UsePoint(lie.hip_m, lie.head_m, _wrapped(side)) for side in sides)


def _reach_m(piece: Piece, hip_m: Vector, side_rad: float) -> float:
    """How far from the hip's place, towards a side, the nearest seat of that side is; infinite
    where there is none."""
    ahead = math.cos(side_rad), math.sin(side_rad)
    return min(
        (
            (p.point_m[0] - hip_m[0]) * ahead[0] + (p.point_m[1] - hip_m[1]) * ahead[1]
            for p in piece.sit
            if abs(_wrapped(p.facing_rad - side_rad)) < _SQUARE_RAD
        ),
        default=math.inf,
    )


def _wrapped(angle_rad: float) -> float:
    return math.remainder(angle_rad, 2 * math.pi)


SIT = Usage("sit", ("chair", "armchair", "low-stool", "high-stool", "sofa"), _seat, wide=False)
LIE = Usage("lie", ("sofa", "bed", "table"), _lying, wide=True)
USAGES = {found.name: found for found in (SIT, LIE)}

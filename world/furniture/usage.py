"""Usages of furniture, to sit and to lie: the use points of a piece, and the classes with them."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from world.errors import ChoiceError, PieceError
from world.furniture.piece import Piece, Vector

#: A seat that faces square to the line from hip to head within this angle is on an access side.
_SQUARE_RAD = math.radians(30.0)
#: A side whose edge is this much farther from the hip than the other's is the far side of a double
#: bed, and no access side, m.
_ACROSS_M = 0.3
#: What lies within these distances to one side of the use point is before a character's half, m.
_HALF_M = (0.10, 0.60)
#: Halves whose fronts differ by more than this have corners of their own, m.
_NOTCH_M = 0.20
#: The axis ahead, by quarter turns of the facing.
_AHEAD = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


@dataclass(frozen=True)
class UsePoint:
    """A use point, in the piece's frame."""

    point_m: Vector
    """Point on the surface below the pelvis."""
    head_m: Vector
    """Point on the surface below the head; of a seat, the same as point_m."""
    facing_rad: float
    """Facing of a seated character; for lying, yaw of the access side."""

    def corners(self, piece: Piece) -> NDArray[np.float64]:
        """The corners of the piece's bounding box [8, 3], m, piece frame, in the use point's order:
        by x (along the facing, to the nearest quarter turn), then y, then z, low first.

        Where the piece reaches further forward on one side of the use point than on the other, as
        an L-shaped sofa does, the front corners of each side are those of that side.

        The observation is then the same from both access sides. In the piece's own order, the
        success on a table fell from 80 of 100 trials to 1.
        """
        quarter = round(self.facing_rad / (math.pi / 2)) % 4
        corners = piece.corners()
        # signs that order the corners: low or high on each axis
        x, y, z = (corners > corners.mean(axis=0)).T * 2 - 1
        for _ in range(quarter):
            x, y = y, -x
        corners = corners[np.lexsort((z, y, x))]
        fronts = [self._front_m(piece, quarter, side) for side in (-1, 1)]
        if abs(fronts[0] - fronts[1]) > _NOTCH_M:
            ahead = _AHEAD[quarter]
            front = (corners @ ahead).max()
            for k, found in ((4, fronts[0]), (6, fronts[1])):
                corners[k : k + 2] += (min(found, front) - front) * ahead
        return corners

    def _front_m(self, piece: Piece, quarter: int, side: int) -> float:
        """How far forward, m, in the piece's frame, it reaches before or beside one half of the
        character at the use point: on its left (1) or its right (-1)."""
        ahead, left = _AHEAD[quarter], _AHEAD[(quarter + 1) % 4]
        found = -math.inf
        for box in piece.boxes:
            corners = box.corners()
            across = side * ((corners - np.asarray(self.point_m)) @ left)
            if across.max() > _HALF_M[0] and across.min() < _HALF_M[1]:
                found = max(found, float((corners @ ahead).max()))
        return found


@dataclass(frozen=True)
class Usage:
    """A usage of furniture."""

    name: str
    """A verb, by which `catalogue(affordance=...)` selects pieces."""
    classes: tuple[str, ...]
    """Classes of the catalogue of which (nearly) every piece has it."""
    use_points: Callable[[Piece], tuple[UsePoint, ...]]
    """The use points of a piece; empty without any."""
    wide: bool
    """Whether the furniture extends far beyond the use point, so that initial states must be clear
    of its whole footprint."""


def usage(name: str) -> Usage:
    """The usage of this name; ChoiceError lists the names."""
    if name not in USAGES:
        raise ChoiceError("affordance", name, list(USAGES))
    return USAGES[name]


def use_points(piece: Piece, affordance: str) -> tuple[UsePoint, ...]:
    """The use points of a piece: its first seat, or its lying target once for each access side.

    Raises PieceError without one.
    """
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
    # a lying target without seats, as on a table, has both sides
    sides = [side for side in both if not reach[side] > nearest + _ACROSS_M]
    return tuple(UsePoint(lie.hip_m, lie.head_m, _wrapped(side)) for side in sides)


def _reach_m(piece: Piece, hip_m: Vector, side_rad: float) -> float:
    """Distance of the nearest seat of a side from the hip, towards that side; infinite without
    one."""
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

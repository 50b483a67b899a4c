"""Where a piece of furniture can be used for what: a seat, or a lying place with the side that it
is got onto by."""

import math
from dataclasses import dataclass

from world.errors import PieceError
from world.furniture.piece import Affordance, Piece, Vector

#: A seat this square to the line from hip to head is on a side that one can get onto the bed by.
_SQUARE_RAD = math.radians(30.0)


@dataclass(frozen=True)
class Spot:
    """One place of use, in the piece's frame."""

    point_m: Vector
    """Below the pelvis, on the surface."""
    head_m: Vector
    """Below the head, on the surface; of a seat, the point itself."""
    facing_rad: float
    """Where its user faces: of a lying place, the side that it is got onto by."""


def spots(piece: Piece, affordance: Affordance) -> tuple[Spot, ...]:
    """The places of use of a piece: its first seat, or its lying place once for each side that it
    can be got onto by. PieceError where it has none."""
    found = _FINDERS[affordance](piece)
    if not found:
        raise PieceError(f"{piece.name}: has no place to {affordance}")
    return found


def _seat(piece: Piece) -> tuple[Spot, ...]:
    return tuple(Spot(p.point_m, p.point_m, p.facing_rad) for p in piece.sit[:1])


def _lying(piece: Piece) -> tuple[Spot, ...]:
    lie = piece.lie
    if lie is None:
        return ()
    along = math.atan2(lie.head_m[1] - lie.hip_m[1], lie.head_m[0] - lie.hip_m[0])
    sides = [
        side
        for side in (along + math.pi / 2, along - math.pi / 2)
        if any(abs(_wrapped(p.facing_rad - side)) < _SQUARE_RAD for p in piece.sit)
    ]
    # a lying place without seats, as on a table: both sides are open
    sides = sides or [along + math.pi / 2, along - math.pi / 2]
    return tuple(Spot(lie.hip_m, lie.head_m, _wrapped(side)) for side in sides)


def _wrapped(angle_rad: float) -> float:
    return math.remainder(angle_rad, 2 * math.pi)


_FINDERS = {"sit": _seat, "lie": _lying}

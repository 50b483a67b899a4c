"""Drop tests of the seat targets found on a piece: those on which a ragdoll rests are kept, shifted
a little where that helps."""

import math
from collections.abc import Iterator
from dataclasses import replace

from world.errors import PieceError
from world.furniture.affordance import seats
from world.furniture.affordance.relief import Relief
from world.furniture.piece import Piece, SeatTarget
from world.objects.drop_test import rests_at, sinks_m, slips_at

MOVES_M = (0.03, 0.06, 0.09, 0.12)
"""Shifts of a target on which the ragdoll does not rest, along its facing or to a side."""
MOST_SUNK_M = 0.06
"""Greatest distance of a resting ragdoll below the seat's height."""
SAME_SEAT_M = 0.04
"""A shift that changes the height by more leaves the seat."""


def confirmed(piece: Piece, solid: Relief) -> Piece:
    """The piece with the targets on which a ragdoll rests at every scale, each with the least shift
    needed; without such a target, the one of most scales. `solid`: relief of the hulls."""
    tried = [_settled(piece, solid, target) for target in piece.sit]
    whole = [target for target in tried if not slips_at(target)]
    best = sorted(tried, key=lambda target: len(slips_at(target)))[:1]  # the first of equals
    return replace(piece, sit=tuple(whole or best))


def required(piece: Piece) -> Piece:
    """The piece, without seat targets on which the ragdoll rests at no scale where they are not its
    use: of a table, or of a bed with a lying target.

    Raises PieceError for another piece whose seat targets all throw the ragdoll off.
    """
    if not piece.sit or any(target.rests_at for target in piece.sit):
        return piece
    if piece.category == "table" or (piece.category == "bed" and piece.lie is not None):
        return replace(piece, sit=())
    raise PieceError(
        f"{piece.name}: a seated ragdoll slides or tips off this {piece.category} at every "
        "scale, so that it has no place to sit; give --sit for another, or --force"
    )


def tested(piece: Piece) -> Piece:
    """The piece with its targets unmoved, and the scales at which a ragdoll rests on them."""
    return replace(piece, sit=tuple(_dropped(piece, target) for target in piece.sit))


def _settled(piece: Piece, solid: Relief, target: SeatTarget) -> SeatTarget:
    """The target with the least shift at which a ragdoll rests at all scales, else the best one."""
    best: SeatTarget | None = None
    for moved in _moves(solid, target):
        found = _dropped(piece, moved)
        if not slips_at(found):
            return found
        if best is None and (lowered := _lowered(piece, moved)) is not None:
            return lowered
        if best is None or len(slips_at(found)) < len(slips_at(best)):
            best = found
    assert best is not None  # _moves yields at least the target itself
    return best


def _lowered(piece: Piece, target: SeatTarget) -> SeatTarget | None:
    """The target where the ragdoll sinks below a seat that slopes or sags, with the seat's own
    height; None where it does not rest there either."""
    sinks = sinks_m(piece, target)
    if sinks is None or not -MOST_SUNK_M <= sinks < 0.0:
        return None
    x, y, z = target.point_m
    lowered = replace(target, point_m=(x, y, z + sinks), seat_m=z)
    found = _dropped(piece, lowered)
    return None if slips_at(found) else found


def _moves(solid: Relief, target: SeatTarget) -> Iterator[SeatTarget]:
    """The target, then shifted ones on the same seat, nearest first."""
    yield target
    x, y, z = target.point_m
    cos, sin = math.cos(target.facing_rad), math.sin(target.facing_rad)
    for step in MOVES_M:
        for along, across in ((step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)):
            point = (x + along * cos - across * sin, y + along * sin + across * cos)
            height = seats.carrying(solid, point, target.facing_rad, z)
            if abs(height - z) <= SAME_SEAT_M:
                yield replace(target, point_m=(*point, height))


def _dropped(piece: Piece, target: SeatTarget) -> SeatTarget:
    return replace(target, rests_at=rests_at(piece, target))

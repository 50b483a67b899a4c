"""Keeps of the places found on a piece those on which a seated ragdoll comes to rest, moved a
little where that makes it stay: what geometry offers, the physics confirms."""

import math
from collections.abc import Iterator
from dataclasses import replace

from world.errors import PieceError
from world.furniture import affordance
from world.furniture.affordance.relief import Relief
from world.furniture.piece import Piece, SeatTarget
from world.objects.drop_test import rests_at, slips_at

MOVES_M = (0.03, 0.06, 0.09, 0.12)
"""How far a place on which nobody stays is moved, back or forth along its facing or to a side."""
SAME_SEAT_M = 0.04
"""Where a move changes the height by more, it leads off the seat."""


def confirmed(piece: Piece, solid: Relief) -> Piece:
    """The piece with the places on which a ragdoll rests at every scale, each moved as little as
    makes it so; where there is none, with the one that does at most scales. `solid`: the relief of
    its hulls."""
    tried = [_settled(piece, solid, place) for place in piece.sit]
    whole = [place for place in tried if not slips_at(place)]
    best = sorted(tried, key=lambda place: len(slips_at(place)))[:1]  # the first of equals
    return replace(piece, sit=tuple(whole or best))


def require(piece: Piece) -> None:
    """Raise PieceError where nobody stays on the piece's places at any scale, nor lies on it."""
    if piece.sit and piece.lie is None and not any(place.rests_at for place in piece.sit):
        raise PieceError(
            f"{piece.name}: a seated ragdoll slides or tips off this {piece.category} at every "
            "scale, so that it has no place to sit; give --sit for another"
        )


def tested(piece: Piece) -> Piece:
    """The piece with its places where they are, and at which scales a ragdoll rests on them."""
    return replace(piece, sit=tuple(_dropped(piece, place) for place in piece.sit))


def _settled(piece: Piece, solid: Relief, place: SeatTarget) -> SeatTarget:
    """The place or the nearest at which a ragdoll rests at all scales, else the best of them."""
    best: SeatTarget | None = None
    for moved in _moves(solid, place):
        found = _dropped(piece, moved)
        if not slips_at(found):
            return found
        if best is None or len(slips_at(found)) < len(slips_at(best)):
            best = found
    assert best is not None  # the place itself is one of its moves
    return best


def _moves(solid: Relief, place: SeatTarget) -> Iterator[SeatTarget]:
    """The place, then those about it on the same seat, nearest first."""
    yield place
    x, y, z = place.point_m
    cos, sin = math.cos(place.facing_rad), math.sin(place.facing_rad)
    for step in MOVES_M:
        for along, across in ((step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)):
            spot = (x + along * cos - across * sin, y + along * sin + across * cos)
            height = affordance.level(solid, spot, place.facing_rad, z)
            if abs(height - z) <= SAME_SEAT_M:
                yield replace(place, point_m=(*spot, height))


def _dropped(piece: Piece, place: SeatTarget) -> SeatTarget:
    return replace(place, rests_at=rests_at(piece, place))

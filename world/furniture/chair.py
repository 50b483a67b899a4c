"""Chairs: a seat and a back, without arms.

The ranges are ours, set around what these give: seat height, depth and recline, EN 1335-1 and
EN 1729-1; seat width and the back's height, ANSI/BIFMA G1 and Panero & Zelnik, "Human Dimension and
Interior Space"; dining chairs, Neufert, "Architects' Data".
"""

import math
from dataclasses import dataclass

import numpy as np

from world.errors import ChoiceError
from world.furniture import seat as seats
from world.furniture.bands import Range, Split, choose, draw
from world.furniture.piece import Piece, Place, assemble

RANGES: dict[str, Range] = {
    "seat_height_m": (0.38, 0.48),
    "seat_depth_m": (0.38, 0.50),
    "seat_width_m": (0.40, 0.52),
    "seat_thickness_m": (0.03, 0.07),
    "seat_tilt_deg": (0.0, 4.0),
    "back_height_m": (0.34, 0.55),
    "back_thickness_m": (0.025, 0.06),
    "recline_deg": (0.0, 15.0),
    "leg_m": (0.03, 0.055),
    "pelvis_from_back_m": (0.16, 0.20),
    "mass_kg": (4.0, 9.0),
}
"""What is drawn, before any scaling; bands.py deals each range out to train and test."""

STYLES: dict[Split, tuple[tuple[str, str], ...]] = {
    "train": (
        ("legs", "solid"),
        ("legs", "splat"),
        ("plinth", "solid"),
        ("pedestal", "splat"),
        ("panels", "solid"),
    ),
    "test": (("legs", "solid"), ("cantilever", "solid"), ("cantilever", "splat")),
}
"""Base and back of each split; cantilevers are never trained on."""

BACKS = ("solid", "splat")
"""solid: one slab; splat: a narrow upright that carries a wide rail."""


@dataclass(frozen=True)
class Dimensions:
    """Everything that determines a chair; the defaults are an ordinary one."""

    seat_height_m: float = 0.43
    """At the front edge."""
    seat_depth_m: float = 0.43
    """From the back's front face to the front edge."""
    seat_width_m: float = 0.45
    seat_thickness_m: float = 0.04
    seat_tilt_deg: float = 2.0
    """Positive is lower at the back."""
    back_height_m: float = 0.42
    """Above the seat, along the slope."""
    back_thickness_m: float = 0.03
    recline_deg: float = 8.0
    """Of the back, from upright."""
    leg_m: float = 0.04
    """Width of a leg."""
    pelvis_from_back_m: float = 0.18
    """Of the pelvis' centre, in front of the back's front face at seat level."""
    mass_kg: float = 6.0
    base: str = "legs"
    """One of seat.BASES."""
    back: str = "solid"
    """One of BACKS."""


def build(dimensions: Dimensions) -> Piece:
    """The chair with these dimensions. Raises ChoiceError for an unknown base or back."""
    d = dimensions
    if d.back not in BACKS:
        raise ChoiceError("chair back", d.back, list(BACKS))
    recline = math.radians(d.recline_deg)
    # The back stands in the slab, which therefore reaches as far back as the back is thick.
    seat = seats.Seat(
        d.seat_height_m,
        d.seat_depth_m,
        d.seat_width_m,
        d.seat_thickness_m,
        math.radians(d.seat_tilt_deg),
        rear_m=d.back_thickness_m,
    )
    foot, top, thick = -d.seat_thickness_m / 2, d.back_height_m, d.back_thickness_m
    if d.back == "splat":
        back = [
            seats.backrest(seat, foot, 0.65 * top, 0.3 * d.seat_width_m, thick, recline),
            seats.backrest(seat, 0.6 * top, top, d.seat_width_m, thick, recline),
        ]
    else:
        back = [seats.backrest(seat, foot, top, d.seat_width_m, thick, recline)]
    x = d.pelvis_from_back_m
    boxes = [seat.box(), *back, *seats.support(d.base, seat, d.leg_m)]
    return assemble("chair", boxes, Place((x, 0.0, seat.surface_m(x))), d.mass_kg)


def dimensions(rng: np.random.Generator, split: Split, turn: int | None = None) -> Dimensions:
    """Dimensions of a chair of this split; styles take turns, or are drawn if turn is None."""
    values = draw(rng, split, RANGES)
    base, back = choose(rng, STYLES[split], turn)
    return Dimensions(**values, base=base, back=back)


def sample(rng: np.random.Generator, split: Split, turn: int | None = None) -> Piece:
    """A chair of this split."""
    return build(dimensions(rng, split, turn))

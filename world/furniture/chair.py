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
from world.furniture.piece import Piece, SeatTarget, assemble

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
"""Ranges of the drawn dimensions, before scaling; bands.py splits each into train and test."""

_FIRST = (
    ("legs", "solid"),
    ("legs", "splat"),
    ("plinth", "solid"),
    ("pedestal", "splat"),
    ("panels", "solid"),
)

STYLES: dict[Split, tuple[tuple[str, str], ...]] = {
    # the first pieces are those that earlier policies were trained on; later ones vary more
    "train": (
        *_FIRST,
        *_FIRST,
        *_FIRST,
        ("plinth", "ladder"),
        ("panels", "spindles"),
        ("sled", "solid"),
        ("pedestal", "spindles"),
        ("plinth", "spindles"),
    ),
    "test": (
        ("legs", "solid"),
        ("cantilever", "solid"),
        ("cantilever", "splat"),
        ("panels", "ladder"),
        ("sled", "solid"),
    ),
}
"""Base and back of each split; cantilevers, and ladders on panels, are in no training split."""

BACKS = ("solid", "splat", "ladder", "spindles")
"""solid: one slab; splat: a narrow upright that carries a wide rail; ladder: two posts and three
slats across; spindles: a wide rail on three thin uprights."""


@dataclass(frozen=True)
class Dimensions:
    """The dimensions of a chair; the defaults are an ordinary one."""

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
    """Distance of the pelvis's centre from the back's front face at seat level."""
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
    back = [
        seats.beside(seats.backrest(seat, low, high, width, thick, recline), across)
        for low, high, width, across in _slabs(d, foot, top)
    ]
    x = d.pelvis_from_back_m
    boxes = [seat.box(), *back, *seats.support(d.base, seat, d.leg_m)]
    return assemble("chair", boxes, SeatTarget((x, 0.0, seat.surface_m(x))), d.mass_kg)


def _slabs(d: Dimensions, foot: float, top: float) -> list[tuple[float, float, float, float]]:
    """From, to (along the slope), width and middle of each slab of the back, m: at most 5."""
    w = d.seat_width_m
    if d.back == "splat":
        return [(foot, 0.65 * top, 0.3 * w, 0.0), (0.6 * top, top, w, 0.0)]
    if d.back == "ladder":
        post = 0.08 * w
        posts = [(foot, top, post, side * (w - post) / 2) for side in (1, -1)]
        slats = [(k * top, (k + 0.16) * top, w, 0.0) for k in (0.25, 0.54, 0.83)]
        return posts + slats
    if d.back == "spindles":
        uprights = [(foot, 0.9 * top, 0.05 * w, k * w) for k in (-0.38, 0.0, 0.38)]
        return [*uprights, (0.85 * top, top, w, 0.0)]
    return [(foot, top, w, 0.0)]


def dimensions(rng: np.random.Generator, split: Split, turn: int | None = None) -> Dimensions:
    """Dimensions of a chair of this split; styles take turns, or are drawn if turn is None."""
    values = draw(rng, split, RANGES)
    base, back = choose(rng, STYLES[split], turn)
    return Dimensions(**values, base=base, back=back)


def sample(rng: np.random.Generator, split: Split, turn: int | None = None) -> Piece:
    """A chair of this split."""
    return build(dimensions(rng, split, turn))

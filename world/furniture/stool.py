"""Stools, low and high: a level seat without a back.

The ranges are ours. Low ones are set around EN 1729-1 and Neufert, "Architects' Data"; high ones
are for perching, between a chair and the bar stool of Panero & Zelnik, "Human Dimension and
Interior Space", and below the character's hips (0.89 m when standing), so that they come down.
"""

from dataclasses import dataclass

import numpy as np

from world.furniture import seat as seats
from world.furniture.bands import Range, Split, choose, draw
from world.furniture.piece import Piece, SeatTarget, assemble

LOW: dict[str, Range] = {
    "seat_height_m": (0.30, 0.45),
    "seat_depth_m": (0.30, 0.44),
    "seat_width_m": (0.32, 0.50),
    "seat_thickness_m": (0.03, 0.08),
    "leg_m": (0.03, 0.06),
    "mass_kg": (3.0, 8.0),
}
"""Ranges of the drawn dimensions of a low stool, before scaling."""

HIGH: dict[str, Range] = {
    "seat_height_m": (0.50, 0.68),
    "seat_depth_m": (0.30, 0.40),
    "seat_width_m": (0.32, 0.44),
    "seat_thickness_m": (0.03, 0.06),
    "leg_m": (0.03, 0.05),
    "mass_kg": (4.0, 9.0),
}
"""Ranges of the drawn dimensions of a high stool, before scaling."""

_FIRST_LOW = ("legs", "plinth", "panels", "braced")
_FIRST_HIGH = ("legs", "pedestal", "panels")

# the first pieces are those that earlier policies were trained on; later ones vary more
LOW_BASES: dict[Split, tuple[str, ...]] = {
    "train": (*_FIRST_LOW, *_FIRST_LOW, *_FIRST_LOW, *_FIRST_LOW, "sled"),
    "test": ("legs", "plinth", "pedestal", "sled"),
}
"""Low stools on a pedestal are never trained on."""

HIGH_BASES: dict[Split, tuple[str, ...]] = {
    "train": (*_FIRST_HIGH, *_FIRST_HIGH, *_FIRST_HIGH, *_FIRST_HIGH, *_FIRST_HIGH, "sled"),
    "test": ("legs", "pedestal", "braced", "sled"),
}
"""High stools with stretchers are never trained on."""


@dataclass(frozen=True)
class Dimensions:
    """The dimensions of a stool; the defaults are an ordinary low one."""

    seat_height_m: float = 0.42
    seat_depth_m: float = 0.36
    seat_width_m: float = 0.40
    seat_thickness_m: float = 0.04
    leg_m: float = 0.04
    """Width of a leg."""
    mass_kg: float = 4.0
    base: str = "legs"
    """One of seat.BASES."""


def build(dimensions: Dimensions, category: str = "low-stool") -> Piece:
    """The stool with these dimensions; its target is the centre of its seat.

    Raises ChoiceError for an unknown base.
    """
    d = dimensions
    seat = seats.Seat(d.seat_height_m, d.seat_depth_m, d.seat_width_m, d.seat_thickness_m)
    boxes = [seat.box(), *seats.support(d.base, seat, d.leg_m)]
    return assemble(
        category, boxes, SeatTarget((d.seat_depth_m / 2, 0.0, d.seat_height_m)), d.mass_kg
    )


def low_dimensions(rng: np.random.Generator, split: Split, turn: int | None = None) -> Dimensions:
    """Dimensions of a low stool of this split; bases take turns, or are drawn if turn is None."""
    values = draw(rng, split, LOW)
    return Dimensions(**values, base=choose(rng, LOW_BASES[split], turn))


def high_dimensions(rng: np.random.Generator, split: Split, turn: int | None = None) -> Dimensions:
    """Dimensions of a high stool of this split; bases take turns, or are drawn if turn is None."""
    values = draw(rng, split, HIGH)
    return Dimensions(**values, base=choose(rng, HIGH_BASES[split], turn))


def sample_low(rng: np.random.Generator, split: Split, turn: int | None = None) -> Piece:
    """A low stool of this split."""
    return build(low_dimensions(rng, split, turn), "low-stool")


def sample_high(rng: np.random.Generator, split: Split, turn: int | None = None) -> Piece:
    """A high stool of this split."""
    return build(high_dimensions(rng, split, turn), "high-stool")

"""Tables: dining and coffee tables, without seats; long ones have a lying target.

The ranges are ours, set around what these give: dining tables, EN 1729-1 and Neufert, "Architects'
Data" (0.70-0.78 m high, 0.70 m and more deep); coffee tables, Panero & Zelnik, "Human Dimension and
Interior Space".
"""

from dataclasses import dataclass

import numpy as np

from world.furniture import seat as seats
from world.furniture.bands import Range, Split, choose, draw
from world.furniture.piece import HIP_TO_HEAD_M, Box, Lying, Piece, assemble

DINING: dict[str, Range] = {
    "height_m": (0.70, 0.78),
    "depth_m": (0.65, 1.10),
    "width_m": (0.80, 2.00),
    "top_m": (0.02, 0.06),
    "leg_m": (0.04, 0.10),
    "mass_kg": (15.0, 60.0),
}
"""Ranges of the drawn dimensions of a dining table, before scaling."""

COFFEE: dict[str, Range] = {
    "height_m": (0.34, 0.52),
    "depth_m": (0.45, 0.80),
    "width_m": (0.60, 1.40),
    "top_m": (0.02, 0.06),
    "leg_m": (0.03, 0.08),
    "mass_kg": (8.0, 30.0),
}
"""Ranges of the drawn dimensions of a coffee table, before scaling."""

LONG_M, DEEP_M = 1.60, 0.70
"""Least size of a top that carries a person of 1.62 m from head to calf."""
_HEAD_M = 0.25
"""Distance of the head's centre from the end of the top."""

STYLES: dict[Split, tuple[tuple[str, str], ...]] = {
    "train": (
        ("dining", "legs"),
        ("coffee", "shelf"),
        ("dining", "pedestal"),
        ("coffee", "legs"),
        ("dining", "braced"),
        ("coffee", "plinth"),
    ),
    "test": (("dining", "legs"), ("coffee", "panels"), ("dining", "panels"), ("coffee", "legs")),
}
"""Kind and base of each split; tables on two panels are in no training split."""


@dataclass(frozen=True)
class Dimensions:
    """The dimensions of a table; the defaults are an ordinary dining table."""

    height_m: float = 0.74
    """Of the top's upper face."""
    depth_m: float = 0.80
    width_m: float = 1.40
    top_m: float = 0.03
    """Thickness of the top."""
    leg_m: float = 0.06
    """Width of a leg."""
    mass_kg: float = 25.0
    base: str = "legs"
    """One of seat.BASES, or shelf: four legs and a shelf between them."""


def build(dimensions: Dimensions) -> Piece:
    """The table with these dimensions. Raises ChoiceError for an unknown base."""
    d = dimensions
    top = seats.Seat(d.height_m, d.depth_m, d.width_m, d.top_m)
    shelf: list[Box] = []
    if d.base == "shelf":
        side = d.width_m / 2
        low = 0.3 * d.height_m
        shelf = [seats.block((0.0, d.depth_m), (-side, side), (low, low + d.top_m))]
    base = seats.support("legs" if d.base == "shelf" else d.base, top, d.leg_m)
    return assemble("table", [top.box(), *shelf, *base], (), d.mass_kg, _lying(d))


def _lying(d: Dimensions) -> Lying | None:
    """The lying target along the top, in the middle of its depth; None on a small table."""
    if d.width_m < LONG_M or d.depth_m < DEEP_M:
        return None
    head = d.width_m / 2 - _HEAD_M
    x, z = d.depth_m / 2, d.height_m
    return Lying((x, head - HIP_TO_HEAD_M, z), (x, head, z))


def dimensions(rng: np.random.Generator, split: Split, turn: int | None = None) -> Dimensions:
    """Dimensions of a table of this split; kinds take turns, or are drawn if turn is None."""
    kind, base = choose(rng, STYLES[split], turn)
    return Dimensions(**draw(rng, split, DINING if kind == "dining" else COFFEE), base=base)


def sample(rng: np.random.Generator, split: Split, turn: int | None = None) -> Piece:
    """A table of this split."""
    return build(dimensions(rng, split, turn))

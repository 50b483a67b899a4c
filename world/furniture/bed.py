"""Beds: a mattress on a frame, with or without head- and footboard; the head end is at -x.

The ranges are ours, set around what these give: mattress lengths and widths, EN 1334 (1.90-2.10 m
by 0.80-1.80 m); thickness and the height of the lying surface, Neufert, "Architects' Data", and
Panero & Zelnik, "Human Dimension and Interior Space" (bedrooms).
"""

import math
from dataclasses import dataclass

import numpy as np

from world.errors import ChoiceError
from world.furniture import seat as seats
from world.furniture.bands import Range, Split, choose, draw
from world.furniture.piece import HIP_TO_HEAD_M, Box, Lying, Piece, SeatTarget, assemble

RANGES: dict[str, Range] = {
    "height_m": (0.36, 0.62),
    "length_m": (1.90, 2.10),
    "width_m": (0.80, 1.80),
    "mattress_m": (0.12, 0.28),
    "rim_m": (0.0, 0.06),
    "headboard_m": (0.25, 0.65),
    "footboard_m": (0.04, 0.30),
    "board_thickness_m": (0.03, 0.10),
    "leg_m": (0.05, 0.10),
    "mass_kg": (35.0, 110.0),
}
"""Ranges of the drawn dimensions, before scaling; bands.py splits each into train and test."""

STYLES: dict[Split, tuple[tuple[str, str], ...]] = {
    "train": (
        ("head", "legs"),
        ("both", "legs"),
        ("none", "plinth"),
        ("head", "plinth"),
        ("both", "boards"),
        ("none", "legs"),
    ),
    "test": (("head", "legs"), ("both", "panels"), ("none", "panels"), ("head", "plinth")),
}
"""Boards and base of each split; beds on two panels are in no training split."""

BOARDS = ("none", "head", "both")
BASES = ("legs", "plinth", "panels", "boards")
"""legs: four; plinth: a divan's block, set back; panels: along both sides; boards: the head- and
footboard carry the frame, as a sled bed's."""

_PILLOW_M = 0.25
"""Distance of the centre of the head from the mattress's head end, m."""
_SINGLE_M = 1.20
"""Wider beds are double beds: the target is on one half, m."""
_OWN_M = 0.45
"""Distance of the lying target from the long edge of a double bed, m."""
_SIT_M = 0.18
"""Distance of the centre of a sitting character's pelvis from the long edge, m."""


@dataclass(frozen=True)
class Dimensions:
    """The dimensions of a bed; the defaults are an ordinary single one."""

    height_m: float = 0.48
    """Of the mattress' upper face."""
    length_m: float = 2.00
    """Of the mattress."""
    width_m: float = 0.90
    """Of the mattress."""
    mattress_m: float = 0.20
    """Thickness of the mattress."""
    rim_m: float = 0.02
    """Width of the frame beyond the mattress on each side."""
    headboard_m: float = 0.45
    """Its height above the mattress."""
    footboard_m: float = 0.15
    """Its height above the mattress."""
    board_thickness_m: float = 0.05
    leg_m: float = 0.07
    """Width of a leg."""
    mass_kg: float = 50.0
    boards: str = "head"
    """One of BOARDS."""
    base: str = "legs"
    """One of BASES."""


def build(dimensions: Dimensions) -> Piece:
    """The bed with these dimensions. Raises ChoiceError for unknown boards or an unknown base."""
    d = dimensions
    if d.boards not in BOARDS:
        raise ChoiceError("bed boards", d.boards, list(BOARDS))
    if d.base not in BASES:
        raise ChoiceError("bed base", d.base, list(BASES))
    half_x, half_y = d.length_m / 2, d.width_m / 2
    under = d.height_m - d.mattress_m
    frame = seats.Seat(under + 0.02, d.length_m, d.width_m + 2 * d.rim_m, min(0.12, under - 0.02))
    carried = [frame.box(), *([] if d.base == "boards" else seats.support(d.base, frame, d.leg_m))]
    mattress = seats.block((0.0, d.length_m), (-half_y, half_y), (under, d.height_m))
    boxes = [mattress, *carried, *_boards(d, frame)]
    own = half_y - _OWN_M if d.width_m > _SINGLE_M else 0.0
    lie = Lying((_PILLOW_M + HIP_TO_HEAD_M, own, d.height_m), (_PILLOW_M, own, d.height_m))
    targets = [
        SeatTarget((half_x, side * (half_y - _SIT_M), d.height_m), side * math.pi / 2)
        for side in (1, -1)
    ]
    return assemble("bed", boxes, targets, d.mass_kg, lie)


def _boards(d: Dimensions, frame: seats.Seat) -> list[Box]:
    """Head- and footboard, down to the floor: at most 2 boxes."""
    side = (-frame.width_m / 2, frame.width_m / 2)
    boxes = []
    if d.boards != "none":
        top = d.height_m + d.headboard_m
        boxes.append(seats.block((-d.board_thickness_m, 0.0), side, (0.0, top)))
    if d.boards == "both":
        reach = (d.length_m, d.length_m + d.board_thickness_m)
        boxes.append(seats.block(reach, side, (0.0, d.height_m + d.footboard_m)))
    return boxes


def dimensions(rng: np.random.Generator, split: Split, turn: int | None = None) -> Dimensions:
    """Dimensions of a bed of this split; styles take turns, or are drawn if turn is None."""
    values = draw(rng, split, RANGES)
    boards, base = choose(rng, STYLES[split], turn)
    return Dimensions(**values, boards=boards, base=base)


def sample(rng: np.random.Generator, split: Split, turn: int | None = None) -> Piece:
    """A bed of this split."""
    return build(dimensions(rng, split, turn))

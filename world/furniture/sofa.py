"""Sofas: a long seat and a back, with two arms, one, none, or a corner to lie in.

The ranges are ours, set around what these give: seat height and depth, and the width of a place,
Panero & Zelnik, "Human Dimension and Interior Space" (residential seating); arms, length and
overall depth, Neufert, "Architects' Data" (living rooms).
"""

import math
from dataclasses import dataclass

import numpy as np

from world.errors import ChoiceError
from world.furniture import seat as seats
from world.furniture.bands import Range, Split, choose, draw
from world.furniture.piece import HIP_TO_HEAD_M, Box, Lying, Piece, SeatTarget, assemble

RANGES: dict[str, Range] = {
    "seat_height_m": (0.36, 0.46),
    "seat_depth_m": (0.48, 0.62),
    "clear_width_m": (1.50, 2.30),
    "seat_thickness_m": (0.10, 0.20),
    "seat_tilt_deg": (0.0, 3.0),
    "back_height_m": (0.36, 0.58),
    "back_thickness_m": (0.10, 0.22),
    "recline_deg": (4.0, 16.0),
    "arm_height_m": (0.14, 0.26),
    "arm_width_m": (0.06, 0.22),
    "chaise_m": (0.45, 0.85),
    "leg_m": (0.04, 0.07),
    "pelvis_from_back_m": (0.17, 0.21),
    "mass_kg": (30.0, 75.0),
}
"""Ranges of the drawn dimensions, before scaling; bands.py splits each into train and test."""

STYLES: dict[Split, tuple[tuple[str, str], ...]] = {
    "train": (
        ("both", "legs"),
        ("both", "plinth"),
        ("none", "legs"),
        ("corner", "plinth"),
        ("both", "panels"),
        ("one", "plinth"),
    ),
    "test": (("both", "legs"), ("both", "plinth"), ("one", "legs"), ("corner", "panels")),
}
"""Arms and base of each split; one arm on legs and corners on panels are in no training split."""

ARMS = ("both", "one", "none", "corner")
"""corner: two arms, and at one end the seat runs on to the front, as a chaise longue."""

_PLACE_M = 0.62
"""Width of a seat, m (Panero & Zelnik: 0.61 to 0.71)."""
_CHAISE_WIDTH_M = 0.68
_THIGH_M = 0.38
"""From the hip to the hollow of the knee, m (humanoid.xml: 0.42 less the shin's radius)."""
_PILLOW_M = 0.22
"""Distance of the centre of the head from the end of the seat, m: its radius and a cushion's
edge."""


@dataclass(frozen=True)
class Dimensions:
    """The dimensions of a sofa; the defaults are an ordinary one."""

    seat_height_m: float = 0.42
    """At the front edge."""
    seat_depth_m: float = 0.55
    """From the back's front face to the front edge."""
    clear_width_m: float = 1.80
    """Of the seat, between the arms."""
    seat_thickness_m: float = 0.15
    seat_tilt_deg: float = 2.0
    """Positive is lower at the back."""
    back_height_m: float = 0.45
    """Above the seat, along the slope."""
    back_thickness_m: float = 0.15
    recline_deg: float = 10.0
    """Of the back, from upright."""
    arm_height_m: float = 0.20
    """Of the arms' upper face above the seat where the pelvis rests."""
    arm_width_m: float = 0.14
    chaise_m: float = 0.60
    """Length of a corner's chaise in front of the seat."""
    leg_m: float = 0.05
    """Width of a leg."""
    pelvis_from_back_m: float = 0.19
    """Distance of the pelvis's centre from the back's front face at seat level."""
    mass_kg: float = 45.0
    arms: str = "both"
    """One of ARMS."""
    base: str = "legs"
    """One of seat.BASES."""


def build(dimensions: Dimensions) -> Piece:
    """The sofa with these dimensions. Raises ChoiceError for unknown arms or an unknown base."""
    d = dimensions
    if d.arms not in ARMS:
        raise ChoiceError("sofa arms", d.arms, list(ARMS))
    seat = seats.Seat(
        d.seat_height_m,
        d.seat_depth_m,
        d.clear_width_m,
        d.seat_thickness_m,
        math.radians(d.seat_tilt_deg),
        rear_m=d.back_thickness_m,
    )
    back = seats.backrest(
        seat,
        -d.seat_thickness_m / 2,
        d.back_height_m,
        d.clear_width_m,
        d.back_thickness_m,
        math.radians(d.recline_deg),
    )
    boxes = [seat.box(), back, *_ends(d, seat), *seats.support(d.base, seat, d.leg_m)]
    return assemble("sofa", boxes, _seat_targets(d, seat), d.mass_kg, _lying(d, seat))


def _ends(d: Dimensions, seat: seats.Seat) -> list[Box]:
    """Arms and chaise: at most 3 boxes; an arm stands on the floor beside the seat."""
    inner, outer = d.clear_width_m / 2, d.clear_width_m / 2 + d.arm_width_m
    top = seat.surface_m(d.pelvis_from_back_m) + d.arm_height_m
    sides = {"both": (1, -1), "corner": (1, -1), "one": (1,), "none": ()}[d.arms]
    boxes = [
        seats.block(
            (-d.back_thickness_m, d.seat_depth_m),
            (inner, outer) if side > 0 else (-outer, -inner),
            (0.0, top),
        )
        for side in sides
    ]
    if d.arms == "corner":
        reach = (d.seat_depth_m - 0.02, d.seat_depth_m + d.chaise_m)
        boxes.append(seats.block(reach, (-inner, _CHAISE_WIDTH_M - inner), (0.0, d.seat_height_m)))
    return boxes


def _seat_targets(d: Dimensions, seat: seats.Seat) -> list[SeatTarget]:
    """The seat targets, the middle one first; there is none on a corner's chaise."""
    low = -d.clear_width_m / 2 + (_CHAISE_WIDTH_M if d.arms == "corner" else 0.0)
    high = d.clear_width_m / 2
    count = max(1, int((high - low) / _PLACE_M))
    step = (high - low) / count
    centres = sorted((low + (i + 0.5) * step for i in range(count)), key=lambda y: (abs(y), y))
    # in a deep seat the target is further forward, so that the knees are over the edge
    x = max(d.pelvis_from_back_m, d.seat_depth_m - _THIGH_M)
    return [SeatTarget((x, y, seat.surface_m(x))) for y in centres]


def _lying(d: Dimensions, seat: seats.Seat) -> Lying:
    """The lying target along the seat: head at the left end (+y), where a single arm is."""
    x = 0.5 * d.seat_depth_m
    head = d.clear_width_m / 2 - _PILLOW_M
    z = seat.surface_m(x)
    return Lying((x, head - HIP_TO_HEAD_M, z), (x, head, z))


def dimensions(rng: np.random.Generator, split: Split, turn: int | None = None) -> Dimensions:
    """Dimensions of a sofa of this split; styles take turns, or are drawn if turn is None."""
    values = draw(rng, split, RANGES)
    arms, base = choose(rng, STYLES[split], turn)
    return Dimensions(**values, arms=arms, base=base)


def sample(rng: np.random.Generator, split: Split, turn: int | None = None) -> Piece:
    """A sofa of this split."""
    return build(dimensions(rng, split, turn))

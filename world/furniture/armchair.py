"""Armchairs: a seat and a back between two arms.

The ranges are ours, set around what these give: armrest height above the seat and clear width
between the arms, EN 1335-1 and ANSI/BIFMA G1 (never below 0.48 m, so that hips fit); seat and back,
Panero & Zelnik, "Human Dimension and Interior Space", and Neufert, "Architects' Data".
"""

import math
from dataclasses import dataclass

import numpy as np

from world.errors import ChoiceError
from world.furniture import seat as seats
from world.furniture.bands import Range, Split, choose, draw
from world.furniture.piece import Box, Piece, SeatTarget, assemble

RANGES: dict[str, Range] = {
    "seat_height_m": (0.36, 0.46),
    "seat_depth_m": (0.42, 0.50),
    "clear_width_m": (0.48, 0.60),
    "seat_thickness_m": (0.05, 0.16),
    "seat_tilt_deg": (0.0, 4.0),
    "back_height_m": (0.40, 0.65),
    "back_thickness_m": (0.04, 0.16),
    "recline_deg": (3.0, 15.0),
    "arm_height_m": (0.18, 0.26),
    "arm_width_m": (0.05, 0.14),
    "arm_setback_m": (0.0, 0.12),
    "leg_m": (0.035, 0.05),
    "pelvis_from_back_m": (0.16, 0.20),
    "mass_kg": (9.0, 25.0),
}
"""Ranges of the drawn dimensions, before scaling; bands.py splits each into train and test."""

_FIRST = ("open", "club", "tub")

STYLES: dict[Split, tuple[str, ...]] = {
    # the first pieces are those that earlier policies were trained on; later ones vary more
    "train": (*_FIRST, *_FIRST, *_FIRST, *_FIRST, *_FIRST, "wing"),
    "test": ("open", "club", "swivel", "wing"),
}
"""Frames of each split; swivel armchairs are in no training split."""

FRAMES = ("open", "club", "tub", "swivel", "wing")
"""open: arm pads on front legs that run up to them; club: walls from the seat up, on four legs;
tub: walls from the floor up around a block; swivel: walls from the seat up, on a pedestal;
wing: as a tub, and ears beside the back up to its top."""


@dataclass(frozen=True)
class Dimensions:
    """The dimensions of an armchair; the defaults are an ordinary one."""

    seat_height_m: float = 0.42
    """At the front edge."""
    seat_depth_m: float = 0.46
    """From the back's front face to the front edge."""
    clear_width_m: float = 0.52
    """Between the arms."""
    seat_thickness_m: float = 0.08
    seat_tilt_deg: float = 3.0
    """Positive is lower at the back."""
    back_height_m: float = 0.50
    """Above the seat, along the slope."""
    back_thickness_m: float = 0.06
    recline_deg: float = 10.0
    """Of the back, from upright."""
    arm_height_m: float = 0.21
    """Of the arms' upper face above the seat where the pelvis rests."""
    arm_width_m: float = 0.06
    arm_setback_m: float = 0.05
    """From the seat's front edge back to the arms' front."""
    leg_m: float = 0.04
    """Width of a leg."""
    pelvis_from_back_m: float = 0.18
    """Distance of the pelvis's centre from the back's front face at seat level."""
    mass_kg: float = 12.0
    style: str = "open"
    """One of FRAMES."""


def build(dimensions: Dimensions) -> Piece:
    """The armchair with these dimensions. Raises ChoiceError for an unknown style."""
    d = dimensions
    if d.style not in FRAMES:
        raise ChoiceError("armchair style", d.style, list(FRAMES))
    outer = d.clear_width_m + 2 * d.arm_width_m
    # The slab reaches under the arms, which stand on its sides, and under the back.
    seat = seats.Seat(
        d.seat_height_m,
        d.seat_depth_m,
        outer if d.style in ("club", "swivel") else d.clear_width_m + d.arm_width_m,
        d.seat_thickness_m,
        math.radians(d.seat_tilt_deg),
        rear_m=d.back_thickness_m,
    )
    x = d.pelvis_from_back_m
    surface = seat.surface_m(x)
    back = seats.backrest(
        seat,
        -d.seat_thickness_m / 2,
        d.back_height_m,
        d.clear_width_m + d.arm_width_m,
        d.back_thickness_m,
        math.radians(d.recline_deg),
    )
    boxes = [seat.box(), back, *_frame(d, seat, surface + d.arm_height_m)]
    return assemble("armchair", boxes, SeatTarget((x, 0.0, surface)), d.mass_kg)


def _frame(d: Dimensions, seat: seats.Seat, top_m: float) -> list[Box]:
    """The arms, up to top_m, and what carries the armchair: at most 6 boxes."""
    inner, outer = d.clear_width_m / 2, d.clear_width_m / 2 + d.arm_width_m
    sides = ((inner, outer), (-outer, -inner))
    front = d.seat_depth_m - d.arm_setback_m
    rear = -d.back_thickness_m
    if d.style == "tub":
        walls = [seats.block((rear, front), y, (0.0, top_m)) for y in sides]
        return [*walls, seat.prop((rear, d.seat_depth_m - d.leg_m), (-inner, inner))]
    if d.style == "wing":
        walls = [seats.block((rear, front), y, (0.0, top_m)) for y in sides]
        crown = seat.surface_m(0.0) + d.back_height_m * math.cos(math.radians(d.recline_deg))
        ears = [seats.block((rear, 0.10), y, (top_m, crown)) for y in sides]
        return [*walls, *ears, seat.prop((rear, d.seat_depth_m - d.leg_m), (-inner, inner))]
    if d.style == "open":
        pads = [seats.block((rear, front), y, (top_m - 0.03, top_m)) for y in sides]
        posts = [seats.block((front - d.leg_m, front), y, (0.0, top_m - 0.03)) for y in sides]
        hind = [seat.prop((rear, rear + d.leg_m), y) for y in seats.edges(seat, d.leg_m)]
        return pads + posts + hind
    bottom = seat.surface_m(rear) - d.seat_thickness_m / 2
    walls = [seats.block((rear, front), y, (bottom, top_m)) for y in sides]
    return walls + seats.support("legs" if d.style == "club" else "pedestal", seat, d.leg_m)


def dimensions(rng: np.random.Generator, split: Split, turn: int | None = None) -> Dimensions:
    """Dimensions of an armchair of this split; styles take turns, or are drawn if turn is None."""
    values = draw(rng, split, RANGES)
    return Dimensions(**values, style=choose(rng, STYLES[split], turn))


def sample(rng: np.random.Generator, split: Split, turn: int | None = None) -> Piece:
    """An armchair of this split."""
    return build(dimensions(rng, split, turn))

"""Common parts of seats of all classes: the seat, its backrest, and its base.

Frame while building: x = 0 where the backrest's front face meets the seat (a stool's rear edge),
+x front, y = 0 in the middle, z = 0 on the floor. `piece.assemble` moves the origin afterwards.
"""

import math
from dataclasses import dataclass, replace

from world.errors import ChoiceError
from world.furniture.piece import Box, Quaternion

Span = tuple[float, float]
"""From, to, along one axis, in m."""


@dataclass(frozen=True)
class Seat:
    """A slab that may slope down towards the back."""

    height_m: float
    """Of the surface at the front edge."""
    depth_m: float
    """From the backrest's front face to the front edge, along x."""
    width_m: float
    thickness_m: float
    tilt_rad: float = 0.0
    """Slope; positive is lower at the back."""
    rear_m: float = 0.0
    """Length of the slab behind the backrest's front face."""

    def surface_m(self, x_m: float) -> float:
        """Height of the surface at x."""
        return self.height_m - (self.depth_m - x_m) * math.tan(self.tilt_rad)

    def box(self) -> Box:
        """The slab."""
        middle = (self.depth_m - self.rear_m) / 2
        down = self.thickness_m / 2
        return Box(
            centre_m=(
                middle + down * math.sin(self.tilt_rad),
                0.0,
                self.surface_m(middle) - down * math.cos(self.tilt_rad),
            ),
            half_m=(
                (self.depth_m + self.rear_m) / 2 / math.cos(self.tilt_rad),
                self.width_m / 2,
                down,
            ),
            quat=pitched(-self.tilt_rad),
        )

    def prop(self, x_m: Span, y_m: Span) -> Box:
        """An upright box over the given stretch of floor that ends inside the slab."""
        return block(x_m, y_m, (0.0, self.surface_m(x_m[0]) - self.thickness_m / 2))


def pitched(angle_rad: float) -> Quaternion:
    """Rotation about +y; a negative angle leans +z backwards and lifts the front of +x."""
    return math.cos(angle_rad / 2), 0.0, math.sin(angle_rad / 2), 0.0


def yawed(angle_rad: float) -> Quaternion:
    """Rotation about +z."""
    return math.cos(angle_rad / 2), 0.0, 0.0, math.sin(angle_rad / 2)


def block(x_m: Span, y_m: Span, z_m: Span) -> Box:
    """An upright box between the given coordinates."""
    spans = (x_m, y_m, z_m)
    cx, cy, cz = ((low + high) / 2 for low, high in spans)
    hx, hy, hz = ((high - low) / 2 for low, high in spans)
    return Box((cx, cy, cz), (hx, hy, hz))


def backrest(
    seat: Seat, from_m: float, to_m: float, width_m: float, thickness_m: float, recline_rad: float
) -> Box:
    """A leaning slab whose front face runs through the seat's surface at x = 0.

    from_m and to_m are measured along the slope from that line, up; recline is from upright.
    """
    along, behind = (from_m + to_m) / 2, thickness_m / 2
    sin, cos = math.sin(recline_rad), math.cos(recline_rad)
    return Box(
        centre_m=(
            -along * sin - behind * cos,
            0.0,
            seat.surface_m(0.0) + along * cos - behind * sin,
        ),
        half_m=(behind, width_m / 2, (to_m - from_m) / 2),
        quat=pitched(-recline_rad),
    )


def beside(box: Box, across_m: float) -> Box:
    """The box moved by across_m to the left."""
    x, y, z = box.centre_m
    return replace(box, centre_m=(x, y + across_m, z))


def edges(seat: Seat, width_m: float) -> tuple[Span, Span]:
    """The strips of y, width_m wide, along the slab's left and right edge."""
    side = seat.width_m / 2
    return (side - width_m, side), (-side, width_m - side)


def legs(seat: Seat, leg_m: float) -> list[Box]:
    """Four square legs under the slab's corners (4 boxes)."""
    rear, front = -seat.rear_m, seat.depth_m
    return [
        seat.prop(x, y)
        for x in ((front - leg_m, front), (rear, rear + leg_m))
        for y in edges(seat, leg_m)
    ]


def pedestal(seat: Seat, leg_m: float) -> list[Box]:
    """A column on a diagonal cross (3 boxes)."""
    middle = (seat.depth_m - seat.rear_m) / 2
    reach = 0.55 * max(seat.depth_m + seat.rear_m, seat.width_m)
    arm = (reach, leg_m / 2, 0.02)
    return [
        seat.prop((middle - leg_m, middle + leg_m), (-leg_m, leg_m)),
        Box((middle, 0.0, 0.02), arm, yawed(math.pi / 4)),
        Box((middle, 0.0, 0.02), arm, yawed(-math.pi / 4)),
    ]


def plinth(seat: Seat, leg_m: float) -> list[Box]:
    """A solid block, set back at the front and the sides by the width of a leg (1 box)."""
    side = seat.width_m / 2 - leg_m
    return [seat.prop((-seat.rear_m, seat.depth_m - leg_m), (-side, side))]


def panels(seat: Seat, leg_m: float) -> list[Box]:
    """Two side walls down to the floor (2 boxes)."""
    return [seat.prop((-seat.rear_m, seat.depth_m), y) for y in edges(seat, leg_m)]


def cantilever(seat: Seat, leg_m: float) -> list[Box]:
    """Two runners on the floor, each with one upright at the front (4 boxes), as Breuer's B 32."""
    rear, front = -seat.rear_m, seat.depth_m
    sides = edges(seat, leg_m)
    runners = [block((rear, front), y, (0.0, leg_m)) for y in sides]
    return runners + [seat.prop((front - leg_m, front), y) for y in sides]


def braced(seat: Seat, leg_m: float) -> list[Box]:
    """Four legs with a stretcher between the two at each side (6 boxes)."""
    x = (-seat.rear_m, seat.depth_m)
    middle = 0.35 * seat.height_m
    z = (middle - leg_m / 2, middle + leg_m / 2)
    return legs(seat, leg_m) + [block(x, y, z) for y in edges(seat, leg_m)]


def sled(seat: Seat, leg_m: float) -> list[Box]:
    """Two runners on the floor, each with an upright at the front and the back (6 boxes)."""
    x = (-seat.rear_m, seat.depth_m)
    return legs(seat, leg_m) + [block(x, y, (0.0, leg_m)) for y in edges(seat, leg_m)]


BASES = {
    "legs": legs,
    "pedestal": pedestal,
    "plinth": plinth,
    "panels": panels,
    "cantilever": cantilever,
    "braced": braced,
    "sled": sled,
}
"""Bases of a seat: (seat, width of a leg in m) -> boxes."""


def support(base: str, seat: Seat, leg_m: float) -> list[Box]:
    """The boxes of a base of BASES. Raises ChoiceError for another."""
    if base not in BASES:
        raise ChoiceError("base", base, list(BASES))
    return BASES[base](seat, leg_m)

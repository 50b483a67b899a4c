"""What to do about a mesh of an implausible size or without a place to sit: the unit and the axis
with which it is furniture."""

import math
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from world.errors import PieceError
from world.furniture.affordance import relief as reliefs
from world.furniture.affordance import seats
from world.meshes import frame as frames
from world.meshes import ground
from world.meshes.frame import METRES, Axis, Frame, Unit
from world.meshes.source import Source

HEIGHTS_M = (0.10, 2.60)
WIDEST_M = 4.5
"""Sizes beyond these are not furniture for one person's use."""
NARROWEST_M = 0.05

Range = tuple[float, float]
ORDINARY_M: dict[str, tuple[Range, Range, Range, Range]] = {
    "chair": ((0.36, 0.52), (0.25, 0.75), (0.36, 0.75), (0.34, 0.68)),
    "armchair": ((0.32, 0.52), (0.22, 0.80), (0.60, 1.25), (0.50, 1.10)),
    "low-stool": ((0.25, 0.52), (0.00, 0.08), (0.28, 1.90), (0.25, 0.70)),
    "high-stool": ((0.55, 0.88), (0.00, 0.50), (0.28, 0.65), (0.25, 0.65)),
    "sofa": ((0.28, 0.55), (0.18, 0.75), (1.15, 3.40), (0.65, 2.20)),
    "bed": ((0.12, 0.80), (0.00, 1.20), (1.75, 2.45), (0.65, 2.20)),
    "table": ((0.33, 0.80), (0.00, 0.30), (0.40, 2.80), (0.35, 1.60)),
}
"""Ordinary height of the seat (of a table, its top), height above it, longer and shorter side of
the floor area by class: ours, around the ranges of the package's own pieces."""
ABOVE_M = 0.3
"""Excess of the height above the seat that counts as one."""
CENTRAL = 0.03
"""Weight of the distance from the middle of the ranges, which decides between equals."""
OTHER_CLASS = 0.5
"""Surcharge of a class other than that of the name."""
TOP_SHARE = 0.35
"""Least fraction of the floor area that a table's top covers."""
ODD, ORDINARY = 0.40, 0.15
"""Unlikeness from which a piece is odd, and up to which it is ordinary."""

Triangles = NDArray[np.float64]


def fits(size_m: NDArray[np.float64]) -> bool:
    """Whether furniture can have the size x, y, z m."""
    x, y, z = size_m
    low, high = HEIGHTS_M
    return bool(low <= z <= high and min(x, y) >= NARROWEST_M and max(x, y) <= WIDEST_M)


def flags(source: Source, frame: Frame, named: str | None = None, within: float = ODD) -> str:
    """The flags that make ordinary furniture of a mesh, of every unit and upward axis; empty where
    none does.

    named: a class that its name states. within: greatest unlikeness.
    """
    found = _best(source, frame, named)
    return found[1] if found is not None and found[0] <= within else ""


def require_ordinary(
    source: Source,
    frame: Frame,
    triangles_m: Triangles,
    named: str | None = None,
    stated_up: bool = True,
) -> None:
    """Raise PieceError for a piece of an odd size that other flags make ordinary, unless the flags
    or a catalogue state size and axis.

    stated_up: whether the frame's axis, if any, is one that the user states.
    """
    stated = frame.unit is not None or frame.height_m is not None
    if frame.size_m is not None or (stated and frame.up is not None and stated_up):
        return
    if unlikeness(triangles_m) < ODD:
        return
    better = flags(source, frame, named, ORDINARY)
    if better:
        size = " x ".join(f"{x:.2f}" for x in np.ptp(triangles_m.reshape(-1, 3), axis=0))
        raise PieceError(
            f"{source.name}: {size} m (x, y, z) is odd, and with {better} it is ordinary "
            "furniture; give that, or --force to keep it"
        )


def unlikeness(triangles_m: Triangles, named: str | None = None) -> float:
    """Distance from ordinary furniture: sum of the logarithmic excesses over the ranges of the
    nearest class; infinite without a seat or a table's top."""
    size = triangles_m.max(axis=(0, 1)) - triangles_m.min(axis=(0, 1))
    if not fits(size):
        return math.inf
    surface = reliefs.relief(triangles_m)
    found = seats.find(surface) or seats.find(reliefs.sheltered(triangles_m))
    top, share = reliefs.main_level(surface)
    values = {"table": top if share >= TOP_SHARE else None}
    long, short = float(max(size[:2])), float(min(size[:2]))
    best = math.inf
    for name, ranges in ORDINARY_M.items():
        level = values.get(name, found[0].point_m[2] if found else None)
        if level is None:
            continue
        excess = sum(
            _excess(x, r)
            for x, r in zip((level, long, short), (ranges[0], *ranges[2:]), strict=True)
        )
        above, (least, most) = float(size[2]) - level, ranges[1]
        excess += max(0.0, least - above - 0.02, above - most) / ABOVE_M
        other = named is not None and name != named and not (named == "stool" and "stool" in name)
        best = min(best, excess + OTHER_CLASS * other)
    return best


def _excess(value: float, bounds: Range) -> float:
    low, high = bounds
    value = max(value, 1e-3)
    middle = CENTRAL * abs(math.log(value / math.sqrt(low * high)))
    return max(0.0, math.log(low / value), math.log(value / high)) + middle


def _best(source: Source, frame: Frame, named: str | None) -> tuple[float, str] | None:
    """The least unlikeness of the other units and upward axes, with their flags; of equals, the one
    of fewest changes."""
    up_now = frame.up or frames.default_up(source.suffix)
    triangles = source.triangles()
    found: list[tuple[float, int, str]] = []
    # a height stands for the unit
    units: tuple[Unit | None, ...] = (None,) if frame.height_m is not None else tuple(METRES)
    unit_now = frame.unit or "m"
    for up in _axes(up_now):
        front = frame.front if up == up_now else None
        turned = triangles @ frames.turn(source.suffix, Frame(up, front)).T
        below = ground.plane(turned)
        turned = turned if below is None else turned[~below]
        low, high = turned.min(axis=(0, 1)), turned.max(axis=(0, 1))
        for unit in units:
            factor = METRES[unit] if unit is not None else 0.0
            if unit is None:
                factor = (frame.height_m or 0.0) / max(float(high[2] - low[2]), 1e-9)
            if (up, unit) in ((up_now, unit_now), (up_now, None)) or not fits(
                (high - low) * factor
            ):
                continue
            scaled = (turned - (low + high) / 2) * factor
            scaled[..., 2] -= scaled[..., 2].min()
            words = [f"--unit {unit}"] if unit not in (None, unit_now) else []
            words += [f"--up {up}"] if up != up_now else []
            found.append((round(unlikeness(scaled, named), 3), len(words), " ".join(words)))
    if not found:
        return None
    best = min(found, key=lambda one: one[:2])
    return best[0], best[2]


def _axes(first: Axis) -> tuple[Axis, ...]:
    """All axes, the given one first, then the likely ones."""
    likely: tuple[Axis, ...] = ("+y", "+z")
    return tuple(dict.fromkeys((first, *likely, *get_args(Axis))))

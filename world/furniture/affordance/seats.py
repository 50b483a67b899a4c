"""Finds where one can sit: a patch that carries a pelvis, room for thighs and shins in front of it,
for the trunk above it, and, where there is one, a back behind it."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from world.furniture.affordance.relief import CELL_M, Relief
from world.furniture.piece import SeatTarget

HEIGHTS_M = (0.12, 0.92)
"""Heights at which a surface can be a seat."""
DIRECTIONS = 24
"""Headings tried, every 15 degrees."""
STEP_M = 0.04
"""Grain at which a body's footprint is looked at."""
LEVEL_M = 0.045
"""How far from its median a seat's surface may be and still carry."""
APART_M = 0.55
"""Distance of two places beside each other."""
KEPT = 0.80
"""Share of the best place's score that another place must have."""
AS_HIGH_M = 0.10
"""How far another place may be from the best one's height: seats are level, arms stand above."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Zone:
    """A rectangle of the body's footprint: along the heading, across it; sampled on a grid."""

    along_m: tuple[float, float]
    across_m: tuple[float, float]

    def points(self) -> Array:
        """[k, 2]: along, across."""
        spans = (self.along_m, self.across_m)
        along, across = (np.arange(low + STEP_M / 2, high, STEP_M) for low, high in spans)
        return np.stack(np.meshgrid(along, across, indexing="ij"), axis=-1).reshape(-1, 2)


PELVIS = Zone((-0.11, 0.11), (-0.15, 0.15))
THIGHS = Zone((0.11, 0.33), (-0.17, 0.17))
KNEES = Zone((0.33, 0.49), (-0.16, 0.16))
SHINS = Zone((0.50, 0.66), (-0.16, 0.16))
TRUNK = Zone((-0.10, 0.12), (-0.20, 0.20))
BACK = Zone((-0.40, -0.12), (-0.16, 0.16))
SIDES = (Zone((-0.10, 0.25), (0.24, 0.44)), Zone((-0.10, 0.25), (-0.44, -0.24)))


def find(relief: Relief, front_rad: float = 0.0) -> tuple[SeatTarget, ...]:
    """Places to sit, best first, piece frame; none where nothing carries and leaves room.

    front_rad: heading of the piece's front, which decides only where the geometry does not.
    """
    x, y = relief.centres()
    flat = _flat(relief)
    rows = np.argwhere(flat)
    if not len(rows):
        return ()
    spots = np.stack((x[rows[:, 0]], y[rows[:, 1]]), axis=1)
    headings = np.arange(DIRECTIONS, dtype=np.float64) * (2 * math.pi / DIRECTIONS)
    scores, heights = zip(
        *(_scored(relief, spots, heading, front_rad) for heading in headings), strict=True
    )
    score, height = np.stack(scores), np.stack(heights)  # [directions, spots]
    return _picked(relief, spots, headings, score, height, front_rad)


def _flat(relief: Relief) -> NDArray[np.bool_]:
    """Cells at a seat's height; every second one of each axis, to halve the work twice."""
    low, high = HEIGHTS_M
    flat = (relief.height_m > low) & (relief.height_m < high)
    flat[1::2] = False
    flat[:, 1::2] = False
    return flat


def _turned(zone: Zone, heading: float) -> Array:
    """[k, 2]: the zone's points about a body with this heading."""
    cos, sin = math.cos(heading), math.sin(heading)
    return zone.points() @ np.array([[cos, sin], [-sin, cos]])


def seen(relief: Relief, spots: Array, zone: Zone, heading: float, raw: bool = False) -> Array:
    """[n, k]: heights in a zone about each spot."""
    at = spots[:, None] + _turned(zone, heading)
    return relief.at(at[..., 0], at[..., 1], raw)


def standing_out(
    relief: Relief, spots: Array, zone: Zone, heading: float, height: Array, by_m: float
) -> Array:
    """Share of a zone's lines along the heading on which anything is by_m above `height` [n]."""
    risen = seen(relief, spots, zone, heading) - height[:, None] > by_m
    across = zone.points()[:, 1]
    lines = [risen[:, across == line].any(axis=1) for line in np.unique(across)]
    return np.stack(lines, axis=1).mean(axis=1)


def _scored(relief: Relief, spots: Array, heading: float, front_rad: float) -> tuple[Array, Array]:
    """Scores [n], −inf where one cannot sit facing so, and seat heights [n] m."""
    pelvis = seen(relief, spots, PELVIS, heading)
    height = np.median(pelvis, axis=1)
    above = pelvis - height[:, None]
    carried = (np.abs(above) < LEVEL_M).mean(axis=1)
    blocked = (seen(relief, spots, TRUNK, heading) - height[:, None] > 0.08).mean(axis=1)
    thighs = seen(relief, spots, THIGHS, heading) - height[:, None]
    held = (np.abs(thighs) < 0.07).mean(axis=1)
    barred = (thighs > 0.09).mean(axis=1)
    knees = (seen(relief, spots, KNEES, heading) - height[:, None] > 0.09).mean(axis=1)
    shins = seen(relief, spots, SHINS, heading) - height[:, None]
    legroom = (shins < -0.10).mean(axis=1)
    low, high = HEIGHTS_M
    possible = (
        (carried > 0.8)
        & (blocked < 0.12)
        & (barred < 0.10)
        & (knees < 0.10)
        & (legroom > 0.6)
        & (height > low)
        & (height < high)
    )
    back, gap, skew = _back(relief, spots, heading, height)
    sides = [seen(relief, spots, side, heading) - height[:, None] for side in SIDES]
    left, right = ((side > 0.10).any(axis=1) for side in sides)
    arms = left & right
    # with a back one sits against it, without in the middle of what carries
    away = np.where(back > 0.25, np.minimum(np.abs(gap - 0.18) / 0.10, 1.5), 0.75)
    # furniture faces along its sides; and without a back, along its front
    turn = heading - front_rad
    prior = 0.3 * math.cos(4 * turn) + np.where(back > 0.25, 0.15, 0.7) * math.cos(turn)
    score = (
        2.0 * carried
        + 0.8 * held
        + 0.6 * legroom
        + 3.0 * back
        - 0.6 * away
        + 0.3 * arms
        - 2.0 * blocked
        - 2.0 * barred
        + prior
        - 1.0 * np.minimum(skew, 1.0)
        + 0.4 * _centred(pelvis, relief, spots, heading, height)
    )
    return np.where(possible, score, -np.inf), height


def _back(
    relief: Relief, spots: Array, heading: float, height: Array
) -> tuple[Array, Array, Array]:
    """How much of the width behind each spot rises as a back does [n], how far behind [n] m, and
    the slope of its line across the heading [n]."""
    zone = BACK.points()
    behind = seen(relief, spots, BACK, heading) - height[:, None]
    risen = behind > 0.14
    lines = np.unique(zone[:, 1])
    distance = np.where(risen, -zone[:, 0], np.inf)
    nearest = np.stack([distance[:, zone[:, 1] == line].min(axis=1) for line in lines], axis=1)
    there = np.isfinite(nearest)
    share = there.mean(axis=1)
    count = np.maximum(there.sum(axis=1), 1)
    gap = np.where(there, nearest, 0.0).sum(axis=1) / count
    middle = (there * lines).sum(axis=1) / count
    offset = np.where(there, lines - middle[:, None], 0.0)
    rise = np.where(there, nearest - gap[:, None], 0.0)
    skew = np.abs((offset * rise).sum(axis=1)) / np.maximum((offset**2).sum(axis=1), STEP_M**2)
    return share, np.where(share > 0, gap, np.inf), skew


def _centred(pelvis: Array, relief: Relief, spots: Array, heading: float, height: Array) -> Array:
    """How evenly the surface runs on to both sides [n]: 1 in the middle of a seat."""
    reach = np.arange(CELL_M, 0.5, CELL_M)
    across = np.array([-math.sin(heading), math.cos(heading)])
    runs = []
    for sign in (1.0, -1.0):
        at = spots[:, None] + (sign * reach)[:, None] * across
        same = np.abs(relief.at(at[..., 0], at[..., 1]) - height[:, None]) < 0.07
        runs.append(np.cumprod(same, axis=1).sum(axis=1) * CELL_M)
    left, right = runs
    return 1.0 - np.abs(left - right) / np.maximum(left + right, CELL_M)


def _picked(
    relief: Relief,
    spots: Array,
    headings: Array,
    score: Array,
    height: Array,
    front_rad: float,
) -> tuple[SeatTarget, ...]:
    """The best place, and those beside it that are nearly as good and face as it does."""
    order = np.argsort(-score, axis=None, kind="stable")
    best = float(score.flat[order[0]])
    if not math.isfinite(best):
        return ()
    first = float(height.flat[order[0]])
    taken: list[tuple[Array, float]] = []
    places: list[SeatTarget] = []
    for flat in order:
        d, n = divmod(int(flat), len(spots))
        if score[d, n] < KEPT * best or not math.isfinite(score[d, n]):
            break
        if abs(float(height[d, n]) - first) > AS_HIGH_M:
            continue
        spot = spots[n]
        if any(math.hypot(*(spot - other)) < APART_M for other, _ in taken):
            continue
        if taken and math.cos(headings[d] - taken[0][1]) < 0.9:
            continue
        taken.append((spot, float(headings[d])))
        places.append(_refined(relief, spot, float(headings[d]), float(height[d, n])))
    return tuple(places)


def _refined(relief: Relief, spot: Array, heading: float, height: float) -> SeatTarget:
    """The place with the height of the surface itself, slits left out."""
    raw = seen(relief, spot[None], PELVIS, heading, raw=True)[0]
    near = raw[np.abs(raw - height) < LEVEL_M]
    z = float(np.median(near)) if len(near) else height
    yaw = math.remainder(heading, 2 * math.pi)
    return SeatTarget((float(spot[0]), float(spot[1]), z), yaw)

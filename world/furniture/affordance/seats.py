"""Finds seat targets: a patch that carries a pelvis, with room for thighs and shins in front and
for the trunk above, and a back behind where there is one."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from world.furniture.affordance.relief import CELL_M, Relief
from world.furniture.piece import SeatTarget

HEIGHTS_M = (0.12, 0.92)
"""Least and greatest height of a seat."""
DIRECTIONS = 24
"""Number of candidate headings, every 15 degrees."""
STEP_M = 0.04
"""Grid step of a body's zones."""
LEVEL_M = 0.045
"""Greatest deviation of a carrying surface from its median."""
APART_M = 0.55
"""Distance of two targets beside each other."""
KEPT = 0.80
"""Least score of another target, as a fraction of the best one's."""
FITS, AGREE = 0.75, 0.4
"""The middle of the directions has at least this fraction of the best score, and their mean is at
least this long: they do not cancel."""
MIDDLE, ONE_SEAT_M = 0.85, 0.35
"""A round back lets a person sit in many directions: the seat's is the middle of those that score
above this fraction of the best, where their targets are this near to the best one's."""
AS_HIGH_M = 0.10
"""Greatest difference of another target's height from the best one's: seats are level, arms
higher."""

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
SEATED = Zone((-0.11, 0.33), (-0.15, 0.15))
"""Pelvis and thighs."""
BACK = Zone((-0.40, -0.12), (-0.16, 0.16))
SIDES = (Zone((-0.10, 0.25), (0.24, 0.44)), Zone((-0.10, 0.25), (-0.44, -0.24)))


SUPPORT, SAGGED_M, RISEN_M = 0.75, 0.07, 0.09
"""Quantile of the surface below pelvis and thighs on which they rest; range of its heights about
the pelvis."""
BACKED = 0.25
"""Least fraction of the width behind a pelvis that a back covers."""


def find(relief: Relief, front_rad: float = 0.0) -> tuple[SeatTarget, ...]:
    """Seat targets, best first, piece frame; empty where nothing carries and leaves room.

    front_rad: heading of the piece's front, used where the geometry does not decide.
    """
    x, y = relief.centres()
    flat = _flat(relief)
    rows = np.argwhere(flat)
    if not len(rows):
        return ()
    points = np.stack((x[rows[:, 0]], y[rows[:, 1]]), axis=1)
    headings = np.arange(DIRECTIONS, dtype=np.float64) * (2 * math.pi / DIRECTIONS)
    scores, heights = zip(
        *(_scored(relief, points, heading, front_rad) for heading in headings), strict=True
    )
    score, height = np.stack(scores), np.stack(heights)  # [directions, points]
    return _picked(relief, points, headings, score, height, front_rad)


def _flat(relief: Relief) -> NDArray[np.bool_]:
    """Cells at a seat's height; every second one of each axis, for a quarter of the work."""
    low, high = HEIGHTS_M
    flat = (relief.height_m > low) & (relief.height_m < high)
    flat[1::2] = False
    flat[:, 1::2] = False
    return flat


def _turned(zone: Zone, heading: float) -> Array:
    """[k, 2]: the zone's points about a body with this heading."""
    cos, sin = math.cos(heading), math.sin(heading)
    return zone.points() @ np.array([[cos, sin], [-sin, cos]])


def zone_heights(
    relief: Relief, points: Array, zone: Zone, heading: float, raw: bool = False
) -> Array:
    """[n, k]: heights in a zone about each point."""
    at = points[:, None] + _turned(zone, heading)
    return relief.at(at[..., 0], at[..., 1], raw)


def standing_out(
    relief: Relief, points: Array, zone: Zone, heading: float, height: Array, by_m: float
) -> Array:
    """[n]: fraction of a zone's lines along the heading on which a surface is by_m above `height`
    [n]."""
    risen = zone_heights(relief, points, zone, heading) - height[:, None] > by_m
    across = zone.points()[:, 1]
    lines = [risen[:, across == line].any(axis=1) for line in np.unique(across)]
    return np.stack(lines, axis=1).mean(axis=1)


def _scored(relief: Relief, points: Array, heading: float, front_rad: float) -> tuple[Array, Array]:
    """Scores [n], −inf where sitting with this heading is impossible, and seat heights [n] m."""
    pelvis = zone_heights(relief, points, PELVIS, heading)
    height = np.median(pelvis, axis=1)
    above = pelvis - height[:, None]
    carried = (np.abs(above) < LEVEL_M).mean(axis=1)
    blocked = (zone_heights(relief, points, TRUNK, heading) - height[:, None] > 0.08).mean(axis=1)
    thighs = zone_heights(relief, points, THIGHS, heading) - height[:, None]
    held = (np.abs(thighs) < 0.07).mean(axis=1)
    barred = (thighs > 0.09).mean(axis=1)
    knees = (zone_heights(relief, points, KNEES, heading) - height[:, None] > 0.09).mean(axis=1)
    shins = zone_heights(relief, points, SHINS, heading) - height[:, None]
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
    back, gap, skew = _back(relief, points, heading, height)
    sides = [zone_heights(relief, points, side, heading) - height[:, None] for side in SIDES]
    left, right = ((side > 0.10).any(axis=1) for side in sides)
    arms = left & right
    # with a back the target is near it, without one in the middle of the carrying surface
    away = np.where(back > BACKED, np.minimum(np.abs(gap - 0.18) / 0.10, 1.5), 0.75)
    # furniture faces along its sides, and without a back along its front
    turn = heading - front_rad
    prior = 0.3 * math.cos(4 * turn) + np.where(back > BACKED, 0.15, 0.7) * math.cos(turn)
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
        + 0.4 * _centred(pelvis, relief, points, heading, height)
    )
    return np.where(possible, score, -np.inf), height


def _back(
    relief: Relief, points: Array, heading: float, height: Array
) -> tuple[Array, Array, Array]:
    """Of a back behind each point: fraction of the width that it covers [n], distance [n] m, and
    slope of its line across the heading [n]."""
    zone = BACK.points()
    behind = zone_heights(relief, points, BACK, heading) - height[:, None]
    risen = behind > 0.14
    lines = np.unique(zone[:, 1])
    distance = np.where(risen, -zone[:, 0], np.inf)
    nearest = np.stack([distance[:, zone[:, 1] == line].min(axis=1) for line in lines], axis=1)
    there = np.isfinite(nearest)
    fraction = there.mean(axis=1)
    count = np.maximum(there.sum(axis=1), 1)
    gap = np.where(there, nearest, 0.0).sum(axis=1) / count
    middle = (there * lines).sum(axis=1) / count
    offset = np.where(there, lines - middle[:, None], 0.0)
    rise = np.where(there, nearest - gap[:, None], 0.0)
    skew = np.abs((offset * rise).sum(axis=1)) / np.maximum((offset**2).sum(axis=1), STEP_M**2)
    return fraction, np.where(fraction > 0, gap, np.inf), skew


def _centred(pelvis: Array, relief: Relief, points: Array, heading: float, height: Array) -> Array:
    """Symmetry [n] of the surface's extent to both sides: 1 in the middle of a seat."""
    reach = np.arange(CELL_M, 0.5, CELL_M)
    across = np.array([-math.sin(heading), math.cos(heading)])
    runs = []
    for sign in (1.0, -1.0):
        at = points[:, None] + (sign * reach)[:, None] * across
        same = np.abs(relief.at(at[..., 0], at[..., 1]) - height[:, None]) < 0.07
        runs.append(np.cumprod(same, axis=1).sum(axis=1) * CELL_M)
    left, right = runs
    return 1.0 - np.abs(left - right) / np.maximum(left + right, CELL_M)


def _picked(
    relief: Relief,
    points: Array,
    headings: Array,
    score: Array,
    height: Array,
    front_rad: float,
) -> tuple[SeatTarget, ...]:
    """The best target, and those beside it with a similar score and the same facing."""
    order = np.argsort(-score, axis=None, kind="stable")
    best = float(score.flat[order[0]])
    if not math.isfinite(best):
        return ()
    facing = _middle(points, headings, score)
    if facing != order[0] // len(points):
        # the same seat in another direction is not a place beside it
        score = np.where((np.arange(len(headings)) == facing)[:, None], score, -np.inf)
        order = np.argsort(-score, axis=None, kind="stable")
        best = float(score.flat[order[0]])
    first = float(height.flat[order[0]])
    taken: list[tuple[Array, float]] = []
    targets: list[SeatTarget] = []
    for flat in order:
        d, n = divmod(int(flat), len(points))
        if score[d, n] < KEPT * best or not math.isfinite(score[d, n]):
            break
        if abs(float(height[d, n]) - first) > AS_HIGH_M:
            continue
        point = points[n]
        if any(math.hypot(*(point - other)) < APART_M for other, _ in taken):
            continue
        if taken and math.cos(headings[d] - taken[0][1]) < 0.9:
            continue
        taken.append((point, float(headings[d])))
        targets.append(_refined(relief, point, float(headings[d]), float(height[d, n])))
    return tuple(targets)


def _middle(points: Array, headings: Array, score: Array) -> int:
    """The index of the heading that the best target faces: the middle of those that are nearly as
    good at the same place, if a person fits in there; else the best one."""
    each = score.max(axis=1)
    top = int(each.argmax())
    above = np.maximum(each - MIDDLE * each[top], 0.0)
    at = points[score.argmax(axis=1)]
    if (np.hypot(*(at - at[top]).T)[above > 0.0] > ONE_SEAT_M).any():
        return top
    mean = np.array([above @ np.cos(headings), above @ np.sin(headings)]) / above.sum()
    nearest = int(np.cos(headings - math.atan2(mean[1], mean[0])).argmax())
    fits = each[nearest] >= FITS * each[top] and np.hypot(*(at[nearest] - at[top])) <= ONE_SEAT_M
    return nearest if fits and np.hypot(*mean) >= AGREE else top


def carrying(relief: Relief, point_m: tuple[float, float], heading: float, near_m: float) -> float:
    """Height of the surface that carries pelvis and thighs at the point, m: the upper quartile of
    the heights near near_m, or of all below them where there are few.

    They rest on the higher part of a surface that slopes or sags: of 59 seats, 58 are then within
    3 cm of the height that their authors state, by the median below the pelvis 54.
    """
    below = zone_heights(relief, np.array([point_m]), SEATED, heading, raw=True)[0]
    near = below[(below - near_m > -SAGGED_M) & (below - near_m < RISEN_M)]
    if len(near) * 4 < len(below):
        below = zone_heights(relief, np.array([point_m]), SEATED, heading)[0]
        near = below[(below - near_m > -SAGGED_M) & (below - near_m < RISEN_M)]
    return float(np.quantile(near if len(near) * 4 >= len(below) else below, SUPPORT))


def backed(relief: Relief, target: SeatTarget) -> bool:
    """Whether there is a back behind a seat target."""
    x, y, z = target.point_m
    fraction, _, _ = _back(relief, np.array([(x, y)]), target.facing_rad, np.array([z]))
    return float(fraction[0]) > BACKED


def _refined(relief: Relief, point: Array, heading: float, height: float) -> SeatTarget:
    """The target at the height of the surface itself, without slits."""
    raw = zone_heights(relief, point[None], PELVIS, heading, raw=True)[0]
    near = raw[np.abs(raw - height) < LEVEL_M]
    z = float(np.median(near)) if len(near) else height
    x, y = float(point[0]), float(point[1])
    return SeatTarget(
        (x, y, carrying(relief, (x, y), heading, z)), math.remainder(heading, 2 * math.pi)
    )

"""Finds lying targets: a stretch that carries trunk and legs, with room for the head at its upper
end, at a headboard, a pillow, an arm or nothing."""

import math

import numpy as np
from numpy.typing import NDArray

from world.furniture.affordance.relief import CELL_M, Relief
from world.furniture.affordance.seats import Zone, standing_out, zone_heights
from world.furniture.piece import HIP_TO_HEAD_M, Lying, SeatTarget

HEIGHTS_M = (0.10, 0.92)
"""Least and greatest height of a surface for lying."""
DIRECTIONS = 16
"""Number of candidate headings, every 22.5 degrees."""
WIDEST_M = 1.6
"""Greatest distance of an edge from the hip."""
FROM_EDGE_M = 0.26
"""Distance from the edge to a sitting character's pelvis, with most of the thighs on the bed."""
LEVEL_M = 0.08
"""Greatest deviation of a carrying surface from its median."""

Array = NDArray[np.float64]

TRUNK = Zone((-0.12, 0.52), (-0.20, 0.20))
THIGHS = Zone((-0.50, -0.12), (-0.18, 0.18))
SHINS = Zone((-0.86, -0.50), (-0.16, 0.16))
HEAD = Zone((HIP_TO_HEAD_M - 0.10, HIP_TO_HEAD_M + 0.10), (-0.10, 0.10))
ABOVE_HEAD = Zone((HIP_TO_HEAD_M + 0.10, HIP_TO_HEAD_M + 0.42), (-0.16, 0.16))
BELOW_FEET = Zone((-1.45, -0.90), (-0.16, 0.16))


def find(relief: Relief, front_rad: float = 0.0) -> Lying | None:
    """The best lying target, piece frame; None where nothing is long and wide enough.

    front_rad: heading of the piece's front; the head is at the other end where the geometry does
    not decide.
    """
    x, y = relief.centres()
    low, high = HEIGHTS_M
    flat = (relief.height_m > low) & (relief.height_m < high)
    flat[1::2] = False
    flat[:, 1::2] = False
    rows = np.argwhere(flat)
    if not len(rows):
        return None
    points = np.stack((x[rows[:, 0]], y[rows[:, 1]]), axis=1)
    headings = np.arange(DIRECTIONS, dtype=np.float64) * (2 * math.pi / DIRECTIONS)
    score = np.stack([_scored(relief, points, heading, front_rad) for heading in headings])
    best = int(np.argmax(score))
    if not math.isfinite(float(score.flat[best])):
        return None
    d, n = divmod(best, len(points))
    hip, heading = points[n], float(headings[d])
    head = hip + HIP_TO_HEAD_M * np.array([math.cos(heading), math.sin(heading)])
    zones = (Zone((-0.1, 0.1), (-0.15, 0.15)), HEAD)
    heights = [
        float(np.median(zone_heights(relief, hip[None], zone, heading)[0])) for zone in zones
    ]
    return Lying(
        (float(hip[0]), float(hip[1]), heights[0]), (float(head[0]), float(head[1]), heights[1])
    )


def edges(relief: Relief, lie: Lying) -> tuple[SeatTarget, ...]:
    """Seat targets on a bed with this lying target: on its long edges, facing out, beside the hip;
    the nearer edge first, none where something blocks it or the drop is too small for the legs."""
    hip, head = np.array(lie.hip_m), np.array(lie.head_m)
    along = math.atan2(head[1] - hip[1], head[0] - hip[0])
    found = []
    for side in (math.pi / 2, -math.pi / 2):
        heading = math.remainder(along + side, 2 * math.pi)
        out = np.array([math.cos(heading), math.sin(heading)])
        reach = np.arange(CELL_M, WIDEST_M, CELL_M)
        at = hip[:2] + reach[:, None] * out
        heights = relief.at(at[:, 0], at[:, 1]) - hip[2]
        gone = np.abs(heights) > LEVEL_M
        if not gone.any():
            continue
        edge = int(np.argmax(gone))
        # a rail or a wall at the edge, or a drop too small for legs
        if heights[edge : edge + 8].max() > LEVEL_M or heights[edge:].min() > -0.10:
            continue
        point = hip[:2] + (reach[edge] - FROM_EDGE_M) * out
        target = SeatTarget((float(point[0]), float(point[1]), float(hip[2])), heading)
        found.append((float(reach[edge]), target))
    return tuple(target for _, target in sorted(found, key=lambda item: item[0]))


def _scored(relief: Relief, points: Array, heading: float, front_rad: float) -> Array:
    """Scores [n] of hips at the points, with the head towards the heading; −inf where lying is
    impossible."""
    trunk = zone_heights(relief, points, TRUNK, heading)
    height = np.median(trunk, axis=1)[:, None]
    carried = (np.abs(trunk - height) < LEVEL_M).mean(axis=1)
    thighs = (np.abs(zone_heights(relief, points, THIGHS, heading) - height) < LEVEL_M).mean(axis=1)
    below = zone_heights(relief, points, SHINS, heading) - height
    # the legs may hang or rest over the arm of a short sofa, or over its end
    shins = (np.abs(below) < LEVEL_M).mean(axis=1)
    barred = (below > 0.30).mean(axis=1)
    head = zone_heights(relief, points, HEAD, heading) - height
    pillow = ((head > -0.08) & (head < 0.25)).mean(axis=1)
    raised = np.clip(head.mean(axis=1), 0.0, 0.10) / 0.10
    low, high = HEIGHTS_M
    possible = (
        (carried > 0.85)
        & (thighs > 0.8)
        & (pillow > 0.9)
        & (barred < 0.3)
        & (height[:, 0] > low)
        & (height[:, 0] < high)
    )
    behind = standing_out(relief, points, ABOVE_HEAD, heading, height[:, 0], 0.10)
    ahead = standing_out(relief, points, BELOW_FEET, heading, height[:, 0], 0.10)
    taller = _highest(relief, points, ABOVE_HEAD, heading) - _highest(
        relief, points, BELOW_FEET, heading
    )
    score = (
        2.0 * carried
        + thighs
        + 0.8 * shins
        - barred
        + 0.6 * behind
        - 0.2 * ahead
        + 1.2 * np.clip(taller, -0.3, 0.3)
        + 0.5 * raised
        + 0.8 * _centred(relief, points, heading, height[:, 0])
        - 2.0 * np.clip(head.mean(axis=1) - 0.12, 0.0, 0.15) / 0.10
        + 0.8 * math.cos(4 * (heading - front_rad))
        - 0.25 * math.cos(heading - front_rad)
    )
    return np.where(possible, score, -np.inf)


def _highest(relief: Relief, points: Array, zone: Zone, heading: float) -> Array:
    return zone_heights(relief, points, zone, heading).max(axis=1)


def _centred(relief: Relief, points: Array, heading: float, height: Array) -> Array:
    """Symmetry [n] of the surface's extent to both sides, up to 0.45 m: 1 in the middle."""
    reach = np.arange(CELL_M, 0.45, 2 * CELL_M)
    across = np.array([-math.sin(heading), math.cos(heading)])
    runs = []
    for sign in (1.0, -1.0):
        at = points[:, None] + (sign * reach)[:, None] * across
        same = np.abs(relief.at(at[..., 0], at[..., 1]) - height[:, None]) < LEVEL_M
        runs.append(np.cumprod(same, axis=1).sum(axis=1) / len(reach))
    return np.minimum(*runs)

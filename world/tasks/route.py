"""Shortest route round a piece of furniture to its access side."""

import torch
from torch import Tensor

from world import rotations
from world.objects.footprint import Footprint
from world.scene.target import Target

#: Clearance of the route, and of its end point, from the furniture's footprint, m.
MARGIN_M, ENTRY_M = 0.30, 0.32
#: A front corner is passed this far ahead of the front edge, m.
_ROUND_M = 0.20
#: Half the width of the way into a notch, m.
_MOUTH_M = 0.35
#: Routes that differ in length by less than this count as equal, m.
_EITHER_M = 0.6


def footprint(target: Target) -> Footprint:
    """The footprint of the furniture of each target."""
    corners = rotations.turn_back(
        target.facing[:, None], target.corners[..., :2] - target.point[:, None, :2]
    )
    return Footprint.of(corners)


def offset(root_xy: Tensor, target: Target) -> Tensor:
    """Points [n, 2] (world, m) in each target's frame, [n, 2] m."""
    return rotations.turn_back(target.facing, root_xy - target.point[:, :2])


def entry(ground: Footprint) -> Tensor:
    """[n, 2]: the point at which the character stands before getting on, target's frame, m."""
    return torch.stack((ground.edge + ENTRY_M, ground.aside), dim=1)


def way(root_xy: Tensor, heading: Tensor, target: Target) -> tuple[Tensor, Tensor]:
    """Unit directions [n, 2], world, of the shortest route to the entry, and its length [n] m.

    The route passes the corners of the footprint, widened by MARGIN_M: straight from the front, by
    the front corner from a side, and from behind by the shorter side. Where both sides differ by
    less than _EITHER_M, it takes the one that the heading [n, 2] points to: a policy would learn
    the mean of both. Into a notch it leads from its mouth.
    """
    ground, here = footprint(target), offset(root_xy, target)
    goal = entry(ground)
    depth = ground.high[:, 0] - ground.edge
    inside = goal - here
    within = (depth > 0.0) & (here[:, 0] > ground.edge) & (inside[:, 0] > -depth)
    within &= inside[:, 1].abs() < _MOUTH_M
    goal = torch.stack((goal[:, 0] + depth, ground.aside), dim=1)
    front, back = ground.high[:, 0] + MARGIN_M, ground.low[:, 0] - MARGIN_M
    x, y = here[:, 0], here[:, 1]
    straight = goal - here
    length = straight.norm(dim=1)
    leans = rotations.turn_back(target.facing, heading)[:, 1] >= 0.0
    ways = []
    for side, edge in ((1.0, ground.high[:, 1] + MARGIN_M), (-1.0, ground.low[:, 1] - MARGIN_M)):
        corner = torch.stack((front, edge), dim=1)
        rear = torch.stack((back, edge), dim=1)
        to_corner, to_rear = corner - here, rear - here
        last = (goal - corner).norm(dim=1)
        beside = side * (y - edge) >= 0.0
        # behind, or in the margin at the back: the rear corner first
        round_it = (x < ground.low[:, 0]) & ~beside
        direct = to_corner.norm(dim=1) + last
        around = to_rear.norm(dim=1) + (front - back) + last
        total = torch.where(round_it, around, direct)
        ways.append((torch.where(round_it[:, None], to_rear, to_corner), total))
    (left, by_left), (right, by_right) = ways
    either = (by_left - by_right).abs() < _EITHER_M
    is_left = torch.where(either, leans, by_left < by_right)
    aim = torch.where(is_left[:, None], left, right)
    best = torch.where(is_left, by_left, by_right)
    # straight in front of the furniture, but not before a front corner is passed
    level = (y > ground.low[:, 1]) & (y < ground.high[:, 1])
    free = (x >= ground.high[:, 0]) & (level | (x >= ground.high[:, 0] + _ROUND_M))
    aim = torch.where(free[:, None], straight, aim)
    best = torch.where(free, length, best)
    best = best + depth
    aim = torch.where(within[:, None], inside, aim)
    best = torch.where(within, inside.norm(dim=1), best)
    unit = aim / aim.norm(dim=1, keepdim=True).clamp_min(1e-6)
    return rotations.turn(target.facing, unit), best

"""The detour round the stand that a box was taken from, where its target lies behind that stand.

Who takes a box up stands before its stand. Where the target is behind the stand, the straight way
is blocked: by its progress alone, to step back costs and to step aside earns nothing.
"""

import torch
from torch import Tensor

#: The way leads round a stand at this distance from its centre, m: the corners of its plate are
#: 0.27 m away.
ROUND_M = 0.55
#: The field is as steep as here any nearer to the centre, m, where no character gets.
_INSIDE_M = 0.2


def extra_m(root: Tensor, start: Tensor, target: Tensor) -> Tensor:
    """[n]: by how much the way from roots [n, 2] round stands at start [n, 2] to target [n, 2] is
    longer than the straight line, m; 0 where no stand is near or between."""
    away, goal = root - start, target - start
    near, far = _length(away), _length(goal).clamp_min(ROUND_M)
    edge = near.clamp_min(ROUND_M)
    angle = _angle(away, goal)
    arc = (angle - torch.acos(ROUND_M / edge) - torch.acos(ROUND_M / far)).clamp_min(0.0)
    tangents = (edge.square() - ROUND_M**2).sqrt() + (far.square() - ROUND_M**2).sqrt()
    # inside the circle the way first leads straight out of it
    clear = _length(goal - away * (edge / near)[:, None])
    onwards = torch.where(arc > 0.0, tangents + ROUND_M * arc, clear)
    return edge - near + onwards - _length(goal - away)


def closing_m_s(root: Tensor, velocity: Tensor, start: Tensor, target: Tensor) -> Tensor:
    """[n]: the speed at which roots [n, 2] of velocity [n, 2] close `extra_m`, m/s."""
    away, goal = root - start, target - start
    near, far = _length(away), _length(goal).clamp_min(ROUND_M)
    edge = near.clamp_min(ROUND_M)
    angle = _angle(away, goal)
    behind = angle > torch.acos(ROUND_M / edge) + torch.acos(ROUND_M / far)
    out, straight = away / near[:, None], goal - away
    side = torch.where(away[:, 0] * goal[:, 1] < away[:, 1] * goal[:, 0], -1.0, 1.0)[:, None]
    aside = side * torch.stack((-out[:, 1], out[:, 0]), dim=1)
    # inside the circle straight out, and with the tangent point, or with the point on the circle
    within = near < ROUND_M
    outward = torch.where(within, 1.0, -(1.0 - (ROUND_M / edge).square()).sqrt())
    clear = far * torch.sin(angle) / _length(goal - away * (edge / near)[:, None])
    around = torch.where(behind, 1.0, clear) * ROUND_M / near.clamp_min(_INSIDE_M)
    way = outward[:, None] * out + around[:, None] * aside
    extra = ((way - straight / _length(straight)[:, None]) * velocity).sum(dim=1)
    return torch.where(behind | within, extra, 0.0)


def _length(vector: Tensor) -> Tensor:
    """[n]: lengths of vectors [n, 2], not 0."""
    return vector.norm(dim=1).clamp_min(1e-6)


def _angle(first: Tensor, second: Tensor) -> Tensor:
    """[n]: angles between vectors [n, 2], rad."""
    cosine = (first * second).sum(dim=1) / (_length(first) * _length(second))
    return torch.acos(cosine.clamp(-1.0, 1.0))

"""Motion of the hands in picking up a box: beside it, onto its faces, and up with it.

Legs and trunk follow the hands. The hands hold the box high and on the near side, which the arms
reach without the body leaning on it.
"""

import torch
from torch import Tensor

from world import rotations
from world.character.model import BODIES
from world.objects import grasp
from world.scene.box import FRICTION
from world.scene.target import BoxState
from world.teachers.scripted.motion import HANDS, Reach
from world.teachers.scripted.whole_body import GRAVITY_M_S2, Figure, shortened

_TORSO = BODIES.index("torso")
#: Of each hand, right first: its side of the box.
SIGNS = (-1.0, 1.0)
#: Largest move of a hand in one step, m.
_STEP_M = 0.1
#: The hands hold this fraction of the half height above the centre, against tilting, but this far
#: below the upper edge, m, against slipping over it...
_HIGH, _BELOW_M = 0.5, 0.06
#: ...and this far from the near edge, m, within bounds of the offset from the centre, m.
_EDGE_M, _NEARER_M = 0.15, (0.02, 0.10)
#: A hand passes a face at this distance until it is within _BESIDE_M of its position, m.
_CLEAR_M, _BESIDE_M = 0.05, 0.06
#: A hand nearer to the plane of its face than this, or behind it, is blocked by the box, m.
_IN_THE_WAY_M = 0.02
#: Hands this near to their positions press and lift, m.
_SIDEWAYS_M, _OFF_M = 0.08, 0.03
#: Hands keep pressing on a box in the air within this distance of their positions, m.
_KEPT_M = 0.25
#: A hand presses with this factor of the force that the weight needs, plus this many N; the last
#: while carrying, since the servos of a moving body lose some force.
_GRIP, _GRIP_N, _GRIP_CARRYING_N = 3.0, 120.0, 190.0
#: Largest move of hands with the box in one step, upwards and horizontally, m.
_LIFT_M, _DRAW_M = 0.04, 0.01
#: The box is drawn towards the body from the first height above its stand on, m, fully from the
#: second height above that on, and at any height this far from the stand, m.
_OFF_STAND_M, _OFF_OVER_M, _AWAY_M = 0.04, 0.06, 0.3
#: Within the first horizontal distance of its target a box is lowered, by at most the second in one
#: step; within the third the arms extend to put it down, m.
_OVER_M, _LOWER_M, _OUT_M = 0.12, 0.02, 0.25


def reach(figure: Figure, box: BoxState, mass_kg: Tensor, carrying: Tensor) -> Reach:
    """The hands' reach for a box, float64, active everywhere; mass_kg [n]: of the boxes; carrying
    [n] bool."""
    heading = rotations.heading(figure.qpos[:, 3:7])
    position = figure.position[:, HANDS]
    grip = grasp.grip_of(box, heading)
    outward = torch.stack([sign * grip.axis for sign in SIGNS], dim=1)
    faces = box.position[:, None] + outward * grip.out_m[:, None, None]
    holds = faces + _hold(box, grip)[:, None]
    placed, at_start = grasp.is_placed(box), grasp.is_at_start(box)
    gap = position - holds
    off = (gap * outward).sum(dim=2)
    across = gap - off[..., None] * outward
    beside = across.norm(dim=2)
    apart = at_start[:, None] & (beside > _BESIDE_M)
    # a standing box may be released and gripped again; a box in the air may not
    close = (beside < _SIDEWAYS_M) & (off.abs() < _OFF_M)
    close |= ~at_start[:, None] & (gap.norm(dim=2) < _KEPT_M)
    pressing = close.all(dim=1) & ~placed
    # the box blocks the space between its faces: move sideways first, then along it
    clear = torch.where(apart | placed[:, None], _CLEAR_M, 0.0)
    aside = (clear - off).clamp(-_STEP_M, _STEP_M)[..., None] * outward
    free = ((off - _IN_THE_WAY_M) / _IN_THE_WAY_M).clamp(0.0, 1.0)
    free = torch.where(apart, free, 1.0)[..., None]
    approach = aside - free * shortened(across.flatten(0, 1), _STEP_M).view_as(across)
    on = _onward(figure, box, heading)[:, None].expand_as(approach)
    held = pressing[:, None, None]
    return Reach(
        active=torch.ones_like(pressing),
        pressing=pressing,
        step=torch.where(held, on, approach),
        force=torch.where(held, _force(position, mass_kg, carrying), 0.0),
        goal=torch.where(held, position, holds),
        height_m=torch.where(pressing, position[..., 2].mean(dim=1), box.position[:, 2]),
        left=grip.axis,
        faces=faces,
    )


def _hold(box: BoxState, grip: grasp.Grip) -> Tensor:
    """[n, 3]: offset from the centre of a face to the hand's position, m: nearer and higher."""
    axes = rotations.matrix(box.rotation)
    ahead = torch.stack((grip.axis[:, 1], -grip.axis[:, 0], torch.zeros_like(grip.out_m)), dim=1)
    along = (axes[:, :, :2] * ahead[:, :, None]).sum(dim=1).abs()
    nearer = ((along * box.half[:, :2]).sum(dim=1) - _EDGE_M).clamp(*_NEARER_M)
    high = torch.minimum(_HIGH * box.half[:, 2:], box.half[:, 2:] - _BELOW_M).clamp_min(0.0)
    return axes[:, :, 2] * high - ahead * nearer[:, None]


def _force(position: Tensor, mass_kg: Tensor, carrying: Tensor) -> Tensor:
    """[n, 2, 3]: forces of hands at [n, 2, 3], N: towards each other, so that they exert no torque
    on the box, and half its weight upwards each."""
    weight = mass_kg * GRAVITY_M_S2
    more = torch.where(carrying, _GRIP_CARRYING_N, _GRIP_N)
    press = _GRIP * weight / (2.0 * FRICTION) + more
    line = position[:, 1] - position[:, 0]
    line = line / line.norm(dim=1, keepdim=True) * press[:, None]
    up = torch.zeros_like(line)
    up[:, 2] = 0.5 * weight
    return torch.stack([up - sign * line for sign in SIGNS], dim=1)


def _onward(figure: Figure, box: BoxState, heading: Tensor) -> Tensor:
    """[n, 3]: next move of the box, m: up before the body, or down where it is over its target."""
    error, gone = box.target - box.position, box.position - box.start
    over = error[:, :2].norm(dim=1) < _OVER_M
    # in front of the chest where the trunk is bent
    chest = (figure.position[:, _TORSO] - figure.position[:, 0])[:, :2]
    lean = (chest * heading).sum(dim=1).clamp_min(0.0)
    held = grasp.held_centre(
        figure.position[:, 0], heading, grasp.half_depth_m(box, heading) + lean
    )
    level = held[:, :2]
    within = (box.target[:, :2] - level).norm(dim=1) < _OUT_M
    level = torch.where(within[:, None], box.target[:, :2], level)
    up = (held[:, 2:] - box.position[:, 2:]).clamp(-_LIFT_M, _LIFT_M)
    free = ((gone[:, 2] - _OFF_STAND_M) / _OFF_OVER_M).clamp(0.0, 1.0)
    free = torch.where(gone[:, :2].norm(dim=1) > _AWAY_M, 1.0, free)
    drawn = shortened(level - box.position[:, :2], _DRAW_M) * free[:, None]
    lifted = torch.cat((drawn, up), dim=1)
    return torch.where(over[:, None], shortened(error, _LOWER_M), lifted)

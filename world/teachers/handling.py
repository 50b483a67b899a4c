"""Where the hands of a whole body go that picks a box up: beside it, onto it, and up with it.

As in world.objects.grasp, but that legs and trunk follow: the hands hold the box high and on the
near side, which the arms reach from before it without the body leaning on it.
"""

import torch
from torch import Tensor

from world import rotations
from world.character.model import BODIES
from world.objects import grasp
from world.scene.box import FRICTION
from world.scene.target import BoxState
from world.teachers.motion import HANDS, Reach
from world.teachers.whole_body import GRAVITY_M_S2, Figure

_TORSO = BODIES.index("torso")
#: Of each hand, right first: the side of the box that it is on.
SIGNS = (-1.0, 1.0)
#: Farthest that a hand is led on at once, m.
_STEP_M = 0.1
#: The hands hold so much of the half height above the middle, where they press against tilting, but
#: this far below the upper edge, m, over which they would slip...
_HIGH, _BELOW_M = 0.5, 0.06
#: ...and nearer than it to whom they belong: as far as leaves this to the near edge, m, in bounds.
_EDGE_M, _NEARER_M = 0.15, (0.02, 0.10)
#: A hand passes beside a face at this distance until it is within _BESIDE_M of its place, m.
_CLEAR_M, _BESIDE_M = 0.05, 0.06
#: A hand nearer to the plane of its face than this, or behind it, does not get past the box, m.
_IN_THE_WAY_M = 0.02
#: Hands this near to where they hold press, and lift, m.
_SIDEWAYS_M, _OFF_M = 0.08, 0.03
#: In the air a box is pressed on by hands this near to where they should hold it, m.
_KEPT_M = 0.25
#: A hand presses this many times as hard as the weight needs, and so many N more, the last of who
#: walks with the box: what the servos of a moving body lose again.
_GRIP, _GRIP_N, _GRIP_LADEN_N = 3.0, 120.0, 190.0
#: Farthest that hands with the box between them go on at once, upwards and sideways, m.
_LIFT_M, _DRAW_M = 0.04, 0.01
#: Off the stand first: from the first height above it on, m, the box is drawn to the body, wholly
#: from so much higher on; and everywhere as far from the stand as the last.
_OFF_STAND_M, _OFF_OVER_M, _AWAY_M = 0.04, 0.06, 0.3
#: So near to its target, horizontally, a box is lowered, by so much at once; within the last the
#: arms reach out to put it down, m.
_OVER_M, _LOWER_M, _OUT_M = 0.12, 0.02, 0.25


def reach(figure: Figure, box: BoxState, mass_kg: Tensor, laden: Tensor) -> Reach:
    """What the hands do with a box before them, float64: led everywhere, whether or not it is in
    reach; mass_kg [n]; laden [n] bool: who walks with it."""
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
    # a box that stands may be let go and gripped better; one in the air may not
    close = (beside < _SIDEWAYS_M) & (off.abs() < _OFF_M)
    close |= ~at_start[:, None] & (gap.norm(dim=2) < _KEPT_M)
    pressing = close.all(dim=1) & ~placed
    # between the planes of the faces the box is in the way: sideways first, then along it
    clear = torch.where(apart | placed[:, None], _CLEAR_M, 0.0)
    aside = (clear - off).clamp(-_STEP_M, _STEP_M)[..., None] * outward
    free = ((off - _IN_THE_WAY_M) / _IN_THE_WAY_M).clamp(0.0, 1.0)
    free = torch.where(apart, free, 1.0)[..., None]
    approach = aside - free * grasp.shortened(across.flatten(0, 1), _STEP_M).view_as(across)
    on = _onward(figure, box, heading)[:, None].expand_as(approach)
    held = pressing[:, None, None]
    return Reach(
        led=torch.ones_like(pressing),
        pressing=pressing,
        step=torch.where(held, on, approach),
        force=torch.where(held, _force(position, mass_kg, laden), 0.0),
        goal=torch.where(held, position, holds),
        height_m=torch.where(pressing, position[..., 2].mean(dim=1), box.position[:, 2]),
        left=grip.axis,
        faces=faces,
    )


def _hold(box: BoxState, grip: grasp.Grip) -> Tensor:
    """[n, 3]: from the middle of a face to where it is held, m: nearer and higher."""
    axes = rotations.matrix(box.rotation)
    ahead = torch.stack((grip.axis[:, 1], -grip.axis[:, 0], torch.zeros_like(grip.out_m)), dim=1)
    along = (axes[:, :, :2] * ahead[:, :, None]).sum(dim=1).abs()
    nearer = ((along * box.half[:, :2]).sum(dim=1) - _EDGE_M).clamp(*_NEARER_M)
    high = torch.minimum(_HIGH * box.half[:, 2:], box.half[:, 2:] - _BELOW_M).clamp_min(0.0)
    return axes[:, :, 2] * high - ahead * nearer[:, None]


def _force(position: Tensor, mass_kg: Tensor, laden: Tensor) -> Tensor:
    """[n, 2, 3]: what hands at [n, 2, 3] press with, N: towards one another, so that neither turns
    the box, and up with half its weight each."""
    weight = mass_kg * GRAVITY_M_S2
    more = torch.where(laden, _GRIP_LADEN_N, _GRIP_N)
    press = _GRIP * weight / (2.0 * FRICTION) + more
    line = position[:, 1] - position[:, 0]
    line = line / line.norm(dim=1, keepdim=True) * press[:, None]
    up = torch.zeros_like(line)
    up[:, 2] = 0.5 * weight
    return torch.stack([up - sign * line for sign in SIGNS], dim=1)


def _onward(figure: Figure, box: BoxState, heading: Tensor) -> Tensor:
    """[n, 3]: where the hands take the box next, m from where it is: up before the body, or down
    once it is over its target."""
    error, gone = box.target - box.position, box.position - box.start
    over = error[:, :2].norm(dim=1) < _OVER_M
    # before the chest, where the trunk is bent
    chest = (figure.position[:, _TORSO] - figure.position[:, 0])[:, :2]
    lean = (chest * heading).sum(dim=1).clamp_min(0.0)
    held = grasp.before(figure.position[:, 0], heading, grasp.deep_m(box, heading) + lean)
    level = held[:, :2]
    within = (box.target[:, :2] - level).norm(dim=1) < _OUT_M
    level = torch.where(within[:, None], box.target[:, :2], level)
    up = (held[:, 2:] - box.position[:, 2:]).clamp(-_LIFT_M, _LIFT_M)
    free = ((gone[:, 2] - _OFF_STAND_M) / _OFF_OVER_M).clamp(0.0, 1.0)
    free = torch.where(gone[:, :2].norm(dim=1) > _AWAY_M, 1.0, free)
    drawn = grasp.shortened(level - box.position[:, :2], _DRAW_M) * free[:, None]
    lifted = torch.cat((drawn, up), dim=1)
    return torch.where(over[:, None], grasp.shortened(error, _LOWER_M), lifted)

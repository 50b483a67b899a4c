"""A trained walking policy as the teacher of the approach to a box, a seat or a bed.

While the box rests where it was, the walker's goal is to stand before the box's nearest face. With
furniture it is to stand at the access side, the back to it; the way there is round the furniture.
What comes then, rewards or others teach.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from world import rotations, tasks
from world.character.features import Body
from world.scene.batch import Scenes
from world.scene.target import BoxState, Target
from world.tasks.carry import (
    DEPTH_COST,
    MIN_HALF_DEPTH_M,
    OFF_STAND_M,
    grips,
    half_depths,
    stand_poses,
)
from world.tasks.route import entry, footprint, offset, way
from world.tasks.walk import Walk
from world.teachers.tracker import Act

#: Who picks a box up stands so far before its face, m (ACCAD's A5 and B19: 0.15 to 0.24).
STANDING_M = 0.18
#: The approach ends within the first distance of there, m, or within the second for one that
#: is slower than this, m/s, and only facing the box, with this cosine: from there on people bend
#: and reach. Who is turned by more cannot, and would stand before the box for ever.
_THERE_M, _NEAR_M, _SLOW_M_S, FACES = 0.12, 0.2, 0.06, 0.94
#: A walker stops so far before its goal, m, which is therefore set beyond the place.
SHORT_M = 0.2
#: A box has been taken that is this much higher than it stood, m; or gripped, and this far from
#: there; or off its stand, even without a grip. One that was pushed still stands.
TAKEN_M = 0.05
#: On the way round furniture the goal is this far ahead, m.
_AHEAD_M = 1.6
#: A route this much longer than the straight line leads round the furniture, m.
_ROUND_M = 0.01
#: With the back to the furniture (the heading has this cosine with the facing, within these of the
#: place before it, m) a character steps back to this far before its edge, where people sit down:
#: the package's clips 0.05-0.1 m. It has a goal so much further back, m.
_TURNED, _BESIDE_M, _BEYOND_M, _EDGE_M, _BACK_M = 0.6, 0.35, 0.25, 0.08, 0.5
#: The approach is over this near to there, ahead and sideways, m.
_EDGE_THERE_M, _EDGE_BESIDE_M = 0.07, 0.2
#: Or where the root is this near to the seat's height, m, and to the edge.
_LOW_M, _ON_M = 0.25, 0.15


@dataclass(frozen=True)
class Lead:
    """Where n characters are to walk."""

    aim: Tensor
    """[n, 2]: goal of the walker, world, m."""
    facing: Tensor
    """[n, 2]: unit vectors to face there, world."""
    over: Tensor
    """[n] bool: the approach is over."""


class WalkerTeacher:
    """Labels scenes in which the box or the furniture is not reached yet; a
    world.teachers.teacher.Teacher without state of its own."""

    def __init__(self, act: Act) -> None:
        """act: actions [n, 28] of states [n, 114] and goals [n, 5] of the task walk."""
        self._act, self._task = act, Walk()

    def reset(self, rows: Tensor, target: Target) -> None:
        """Nothing: a walker acts on the present state alone."""

    def label(self, scenes: Scenes, target: Target, variant: Tensor, clock: int) -> Tensor:
        """Teacher actions [n, 28] float32; NaN where the approach is over."""
        body = scenes.body()
        lead = to_furniture(body, target) if target.box is None else to_box(body, target.box)
        point = torch.cat((lead.aim, torch.zeros_like(lead.aim[:, :1])), 1)
        walk = Target(point, lead.facing, target.corners)
        goal = self._task.goal_features(body, walk)
        action = self._act(tasks.state(body, walk), goal).to(torch.float32)
        return torch.where(lead.over[:, None], torch.nan, action)

    def state_dict(self) -> dict[str, Tensor]:
        """Nothing."""
        return {}

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Nothing."""


def to_box(body: Body, box: BoxState) -> Lead:
    """Up to the box's face; over where the character stands there, or the box is taken."""
    here = body.root[:, :2]
    point, ahead = standing_place(here, box)
    beyond = point - here
    far = beyond.norm(dim=1, keepdim=True).clamp_min(1e-6)
    aim = point + beyond / far * far.clamp_max(SHORT_M)
    away = beyond.norm(dim=1)
    stands = body.root_velocity[:, :2].norm(dim=1) < _SLOW_M_S
    there = (away < _THERE_M) | (stands & (away < _NEAR_M))
    there &= (body.heading * ahead).sum(dim=1) > FACES
    return Lead(aim, ahead, there | taken(body, box))


def taken(body: Body, box: BoxState) -> Tensor:
    """[n] bool: the box is off its stand, or on the way."""
    moved = box.position - box.start
    level, up = moved[:, :2].norm(dim=1), moved[:, 2]
    gripped = (level > TAKEN_M) & grips(body, box)
    return (up > TAKEN_M) | (level > OFF_STAND_M[0]) | gripped


def to_furniture(body: Body, target: Target) -> Lead:
    """Round the furniture to its access side, and with the back to it up to its edge; over there,
    and on the furniture."""
    here, ground = body.root[:, :2], footprint(target)
    local, place = offset(here, target), entry(ground)
    direction, length = way(here, body.heading, target)
    away = (place - local).norm(dim=1)
    straight = (length - away < _ROUND_M) & (away < _AHEAD_M)
    reach = torch.where(straight, away + away.clamp_max(SHORT_M), _AHEAD_M)
    aim = here + direction * reach[:, None]
    facing = torch.where(straight[:, None], target.facing, direction)
    edge = ground.edge + _EDGE_M
    x, beside = local[:, 0], (local[:, 1] - ground.aside).abs()
    before = (x > ground.low[:, 0]) & (x < place[:, 0] + _BEYOND_M) & (beside < _BESIDE_M)
    turned = before & ((body.heading * target.facing).sum(dim=1) > _TURNED)
    back = torch.stack((edge - _BACK_M, ground.aside), dim=1)
    behind = target.point[:, :2] + rotations.turn(target.facing, back)
    aim = torch.where(turned[:, None], behind, aim)
    facing = torch.where(turned[:, None], target.facing, facing)
    there = turned & (x < edge + _EDGE_THERE_M) & (beside < _EDGE_BESIDE_M)
    low = body.root[:, 2] < target.point[:, 2] + _LOW_M
    sits = before & low & (x < ground.edge + _ON_M)
    return Lead(aim, facing, there | sits)


def standing_place(here: Tensor, box: BoxState) -> tuple[Tensor, Tensor]:
    """Return the floor points [n, 2], m, before the box's faces that are nearest to `here` [n, 2],
    m, and the headings [n, 2] towards the box; a deep box is taken from its long side."""
    ahead, _ = stand_poses(box)
    points = box.position[:, None, :2] - ahead * (half_depths(box) + STANDING_M)[..., None]
    deeper = (half_depths(box) - MIN_HALF_DEPTH_M).clamp_min(0.0)
    face = ((points - here[:, None]).norm(dim=2) + DEPTH_COST * deeper).argmin(dim=1)
    rows = torch.arange(len(face), device=face.device)
    return points[rows, face], ahead[rows, face]

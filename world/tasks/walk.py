"""Walk: reach a point on the floor and stand there, facing a direction.

The reward has sit's form (InterScene's, after the paper's supplement) without furniture: the
approach is straight, and only the last steps turn to the target's facing.
"""

import math
from typing import ClassVar

import torch
from torch import Tensor

from world import rotations
from world.affordances import FLOOR
from world.character import model as character
from world.character.features import Body, Feature, Table
from world.scene.target import Target
from world.tasks.sit import compressed, fallen
from world.tasks.task import Task

#: Height of the root of a standing character, m.
_STANDING_M = float(character.standing_qpos()[2])
#: Speed of approach that earns the full reward, m/s (mocap walks at 0.5-1.1).
_SPEED_M_S = 0.9
#: The approach ends within this of the point, where the character turns to the target's facing, m.
_ARRIVED_M = 0.35
#: Spinning counts as overspeed within this of the point, m.
_NEAR_M = 0.8
#: Heights of the root, m, between which the term "upright" rises from 0 to 1. In mocap of walking
#: it is at 0.80-0.87; without the term a policy walked and stood on bent knees, at 0.79.
_BENT_M, _UPRIGHT_M = 0.70, 0.83
#: Success: the root this near to the point horizontally, m, its heading this near to the facing,
#: rad, and slower than this, m/s, so that walking through the point does not count. Walking is
#: twice as fast; standing sways at a quarter of it.
_THERE_M, _FACING_RAD, _STILL_M_S = 0.2, math.radians(20.0), 0.4
_HEADING_FRAME = "root heading"


class Walk(Task):
    """The walk task."""

    name = "walk"
    affordance = FLOOR
    goal = Table(
        "goal",
        Feature(
            "target",
            3,
            _HEADING_FRAME,
            "m, beyond 1.5 m logarithmic",
            f"compressed(H @ (u + np.array([0, 0, {_STANDING_M}]) - p))",
        ),
        Feature("facing", 2, _HEADING_FRAME, "cosine, sine", "(H @ O[:, 0])[:2]"),
    )
    level: ClassVar[tuple[str, ...]] = ("target", "object_position")
    terms: ClassVar[dict[str, float]] = {
        "stand": 0.35,
        "approach": 0.25,
        "facing": 0.2,
        "upright": 0.2,
        "overspeed": 0.4,
    }
    stages: ClassVar[tuple[str, ...]] = ("approached", "arrived", "facing")
    success_m = _THERE_M

    def goal_features(self, body: Body, target: Target) -> Tensor:
        up = target.point.new_tensor((0.0, 0.0, _STANDING_M))
        offset = rotations.turn_back(body.heading, target.point + up - body.root)
        facing = rotations.turn_back(body.heading, target.facing)
        return torch.cat((compressed(offset), facing), dim=1)

    def reward_terms(self, body: Body, target: Target) -> Tensor:
        offset = (target.point - body.root)[:, :2]
        distance = offset.norm(dim=1)
        near = 0.5 * torch.exp(-10.0 * distance.square()) + 0.5 * torch.exp(-40.0 * distance**2)
        speed = body.root_velocity[:, :2].norm(dim=1)
        stand = near * (0.6 + 0.4 * torch.exp(-8.0 * speed.square()))
        direction = offset / distance.clamp_min(1e-6)[:, None]
        towards = (direction * body.root_velocity[:, :2]).sum(dim=1)
        approach = (towards / _SPEED_M_S).clamp(0.0, 1.0)
        arrived = distance < _ARRIVED_M
        # standing at the point earns as much as walking there, standing beside it less
        approach = torch.where(arrived, 0.5 + 0.5 * near, approach)
        wanted = torch.where(arrived[:, None], target.facing, direction)
        # linear in the angle: the gradient of turning is the same at every angle, also at 180
        facing = 1.0 - _angle(wanted, body.heading) / torch.pi
        upright = ((body.root[:, 2] - _BENT_M) / (_UPRIGHT_M - _BENT_M)).clamp(0.0, 1.0)
        # everywhere: without it a policy ran, at 1.7 m/s, and fell more the further it had to go
        fast = (speed - 1.3).clamp(0.0, 1.0)
        spin = ((body.angular_velocity[:, 2].abs() - 3.0) / 3.0).clamp(0.0, 1.0)
        overspeed = -torch.maximum(fast, torch.where(distance < _NEAR_M, spin, 0.0))
        return torch.stack((stand, approach, facing, upright, overspeed), dim=1)

    def error_m(self, body: Body, target: Target) -> Tensor:
        """[n]: the largest of distance, angle and speed, each scaled so that its limit is 0.2 m."""
        distance = _distance(body, target)
        turned = _angle(target.facing, body.heading) * (_THERE_M / _FACING_RAD)
        moving = body.root_velocity[:, :2].norm(dim=1) * (_THERE_M / _STILL_M_S)
        return torch.maximum(torch.maximum(distance, turned), moving)

    def stage(self, body: Body, target: Target) -> Tensor:
        distance = _distance(body, target)
        there = distance <= _THERE_M
        facing = there & (_angle(target.facing, body.heading) <= _FACING_RAD)
        return torch.stack((distance < _ARRIVED_M, there, facing), dim=1)

    def fell(self, body: Body, target: Target) -> Tensor:
        return fallen(body)


def _distance(body: Body, target: Target) -> Tensor:
    """[n]: horizontal distance of the root from the point, m."""
    return (target.point - body.root)[:, :2].norm(dim=1)


def _angle(first: Tensor, second: Tensor) -> Tensor:
    """[n]: the angle between unit vectors [n, 2], rad, in [0, π]."""
    return torch.acos((first * second).sum(dim=1).clamp(-1.0, 1.0))

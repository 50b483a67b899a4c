"""Lie: bring hip and head to their targets on a bed, a sofa or a table, and stay there.

No open reward of this task exists for a human character. This one has a half each for hip and head,
with wide kernels, the head's half multiplied by the hip's, and the approach of sit, which leads
round the furniture to its access side.
"""

from typing import ClassVar

import torch
from torch import Tensor

from world import rotations
from world.affordances import BED
from world.character.features import Body, Feature, Table
from world.objects.footprint import Footprint
from world.scene.target import Target
from world.tasks.evaluation import Evaluation, Published
from world.tasks.route import entry, footprint, offset, way
from world.tasks.sit import compressed, fallen
from world.tasks.task import Task

#: Heights of the root and of the head's centre above the surface when lying, m: medians over the
#: lying mocap (0.09-0.16 and 0.10-0.33, the most with a hand under the head).
HIP_ABOVE_M, HEAD_ABOVE_M = 0.097, 0.122
#: Speed of approach that earns the full reward, m/s.
_SPEED_M_S = 0.9
#: The approach ends within the first distance of the entry; half width of the corridor from there
#: to the hip's target, m.
_ARRIVED_M, _CORRIDOR_M = 0.40, 0.50
#: The overspeed penalty applies within this of the furniture's footprint, m.
_NEAR_M = 0.7
#: Height above its target up to which the root counts as on the furniture, m.
_ON_M = 0.20
_HEADING_FRAME = "root heading"


class Lie(Task):
    """The lie task."""

    name = "lie"
    affordance = BED
    goal = Table(
        "goal",
        Feature(
            "target",
            3,
            _HEADING_FRAME,
            "m, beyond 1.5 m logarithmic",
            f"compressed(H @ (u + np.array([0, 0, {HIP_ABOVE_M}]) - p))",
        ),
        Feature(
            "head",
            3,
            "root heading's axes, from the target",
            "m",
            f"H @ (h - u + np.array([0, 0, {HEAD_ABOVE_M} - {HIP_ABOVE_M}]))",
        ),
        Feature("facing", 2, _HEADING_FRAME, "cosine, sine", "(H @ O[:, 0])[:2]"),
        Feature(
            "corners",
            24,
            "root heading's axes, from the target",
            "m, in the target's order",
            f"((c - u - np.array([0, 0, {HIP_ABOVE_M}])) @ H.T).ravel()",
        ),
    )
    # a bed's corners lie far outside the range of a chair's: a sit policy given them falls over
    equivalents: ClassVar[dict[str, str]] = {"corners": ""}
    # the head's target is on the left of the access side; the other side is its mirror image
    sides: ClassVar[tuple[str, str] | None] = ("facing", "head")
    level: ClassVar[tuple[str, ...]] = ("object_position",)
    terms: ClassVar[dict[str, float]] = {
        "lie": 0.5,
        "approach": 0.2,
        "posture": 0.3,
        "overspeed": 0.2,
    }
    stages: ClassVar[tuple[str, ...]] = ("approached", "touched", "lain")
    success_m = 0.3
    evaluation = Evaluation(
        published={
            "table1": (Published("paper", 90.2, 6.3, 13.4),),
            "table3": (Published("paper", 80.0, 6.9, 30.0), Published("SAMP", 50.0, 9.5, 5.0)),
        },
        perturbed=(Published("paper", 82.0),),
    )

    def hip_and_head(self, target: Target) -> tuple[Tensor, Tensor]:
        """Targets of the root and of the head's centre, world, m: two of [n, 3]."""
        assert target.head is not None, "a target for lying has a head"
        up = target.point.new_tensor((0.0, 0.0, 1.0))
        return target.point + HIP_ABOVE_M * up, target.head + HEAD_ABOVE_M * up

    def goal_features(self, body: Body, target: Target) -> Tensor:
        hip, head = self.hip_and_head(target)
        ahead = rotations.turn_back(body.heading, hip - body.root)
        along = rotations.turn_back(body.heading, head - hip)
        facing = rotations.turn_back(body.heading, target.facing)
        corners = rotations.turn_back(body.heading[:, None], target.corners - hip[:, None])
        return torch.cat((compressed(ahead), along, facing, corners.flatten(1)), dim=1)

    def reward_terms(self, body: Body, target: Target) -> Tensor:
        hip, head = self.hip_and_head(target)
        hip_error = (hip - body.root).square().sum(dim=1)
        head_error = (head - body.head).square().sum(dim=1)
        # the head counts only with the hip: independent halves rewarded sitting upright for ever
        lie = _near(hip_error) * (0.4 + 0.6 * _near(head_error))
        ground = footprint(target)
        direction, _ = way(body.root[:, :2], body.heading, target)
        here = arrived(body, target, ground)
        speed = (direction * body.root_velocity[:, :2]).sum(dim=1)
        towards = (speed / _SPEED_M_S).clamp(0.0, 1.0)
        close = torch.exp(-2.5 * hip_error)
        # standing at the edge must earn less than walking there or sitting on it, and all of these
        # far less than lying
        on = torch.maximum(close, _on(body, target, ground, hip))
        towards = torch.where(here, 0.2 + 0.8 * on, towards)
        down = (2.0 * _aligned(body.head - body.root, head - hip) - 1.0).clamp_min(0.0)
        posture = torch.where(
            here,
            # at the edge the character turns its back to the furniture; on it, the trunk goes down
            # along it. With no reward for an upright trunk, sitting on a high edge earned no more
            # than standing at it, and the policy stood
            (1.0 - on) * _turned(body.heading, target.facing) + on * (0.5 + 0.5 * down),
            _turned(body.heading, direction),
        )
        near = ground.holds(offset(body.root[:, :2], target), _NEAR_M)
        fast = (body.root_velocity[:, :2].norm(dim=1) - 1.3).clamp(0.0, 1.0)
        spin = ((body.angular_velocity[:, 2].abs() - 3.0) / 3.0).clamp(0.0, 1.0)
        overspeed = torch.where(near, -torch.maximum(fast, spin), 0.0)
        return torch.stack((lie, towards, posture, overspeed), dim=1)

    def error_m(self, body: Body, target: Target) -> Tensor:
        """[n]: the larger of the distances of hip and head from their targets, m."""
        hip, head = self.hip_and_head(target)
        return torch.maximum((hip - body.root).norm(dim=1), (head - body.head).norm(dim=1))

    def stage(self, body: Body, target: Target) -> Tensor:
        ground = footprint(target)
        hip, _ = self.hip_and_head(target)
        over = ground.holds(offset(body.root[:, :2], target))
        touched = over & (body.root[:, 2] < hip[:, 2] + _ON_M)
        lain = self.error_m(body, target) <= self.success_m
        return torch.stack((arrived(body, target, ground), touched, lain), dim=1)

    def low(self, body: Body, target: Target) -> Tensor:
        return footprint(target).holds(offset(body.root[:, :2], target), 0.35)

    def fell(self, body: Body, target: Target) -> Tensor:
        return fallen(body)


def arrived(body: Body, target: Target, ground: Footprint) -> Tensor:
    """[n] bool: at the entry, between it and the hip's target, or on the furniture."""
    here = offset(body.root[:, :2], target)
    goal = entry(ground)
    at_entry = (goal - here).norm(dim=1) < _ARRIVED_M
    beside = (here[:, 1] - 0.5 * ground.aside).abs()
    corridor = (here[:, 0] > 0.0) & (here[:, 0] < goal[:, 0]) & (beside < _CORRIDOR_M)
    # a footprint with a notch holds a floor to walk on, and the part that reaches forward
    notched = ground.edge < ground.high[:, 0]
    return at_entry | corridor | (ground.holds(here) & ~(notched & (here[:, 0] > ground.edge)))


def _on(body: Body, target: Target, ground: Footprint, hip: Tensor) -> Tensor:
    """[n] in [0, 1]: how far the root is over the front edge and low enough to rest there."""
    here = offset(body.root[:, :2], target)
    over = ((ground.edge - here[:, 0] + 0.05) / 0.25).clamp(0.0, 1.0)
    low = ((hip[:, 2] + 0.30 - body.root[:, 2]) / 0.15).clamp(0.0, 1.0)
    return torch.where(ground.holds(here, 0.05), over * low, 0.0)


def _near(error: Tensor) -> Tensor:
    """[n] in [0, 1]: closeness, by squared distances [n], m². The narrow kernel alone is flat at
    0.85 m, where the head of a character that sits at the edge is."""
    return 0.5 * torch.exp(-10.0 * error) + 0.5 * torch.exp(-2.0 * error)


def _turned(heading: Tensor, wanted: Tensor) -> Tensor:
    """[n] in [0, 1]: 1 where the unit vectors [n, 2] agree, linear in the angle between them."""
    cosine = (heading * wanted).sum(dim=1).clamp(-1.0, 1.0)
    return 1.0 - torch.acos(cosine) / torch.pi


def _aligned(along: Tensor, wanted: Tensor) -> Tensor:
    """[n] in [0, 1]: the same as `_turned` for vectors [n, 3] of any length."""
    lengths = along.norm(dim=1) * wanted.norm(dim=1)
    cosine = ((along * wanted).sum(dim=1) / lengths.clamp_min(1e-6)).clamp(-1.0, 1.0)
    return 1.0 - torch.acos(cosine) / torch.pi

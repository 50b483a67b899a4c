"""The path: the face of the box to approach, the way round the stands, and the step command.

All functions are stateless; arguments carry the previous choices.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from world import rotations
from world.objects.grasp import half_depth_m
from world.scene.target import BoxState
from world.tasks.carry import DEPTH_COST, MIN_HALF_DEPTH_M, half_depths, stand_poses
from world.teachers.scripted.gait import Footing, wrapped

#: The character's position lies this far behind the centre of the soles, m: about the ankles.
_BEHIND_M = 0.035
#: Distance from the box's edge at which it is put down, m.
_GAP_DOWN_M = 0.19
#: Cost of a face besides its distance and depth, m: per metre that the character is behind it, and
#: per radian of the turn towards the target afterwards.
_COST_ROUND, _COST_TURN_M = 1.0, 0.3
#: The chosen face is kept unless another one is better by this, m.
_KEEP_M = 0.3
#: The approach goes to a point this far before the pick-up point, then straight on, m.
_BEFORE_M = 0.15
#: The approach is straight within these lateral offsets, m, and angles, rad: the first to enter,
#: the second to stay; and up to these distances past the pick-up point and before the other, m.
_BESIDE_M, _FACING_RAD, _PAST_M, _SHORT_M = (0.07, 0.27), (0.3, 0.7), 0.12, 0.3
#: Arrival at the pick-up point, m and rad; the box may be picked up within _NEAR_ENOUGH times
#: these; the character stays within _NEAR_ENOUGH times the distance and _STAYS_TURNED times the
#: angle.
_AT_M, _AT_RAD = 0.14, 0.28
_NEAR_ENOUGH, _STAYS_TURNED = 1.5, 1.3
#: A stalled character may try within this many times the bounds of arrival.
_BY_BOX = 2.8
#: Arrival with the box at the target, and the bounds to stay there: m and rad.
_DONE_M, _DONE_RAD, _STAY_M, _STAY_RAD = 0.1, 0.3, 0.18, 0.5
#: Bounds within which the box may be put down, m and rad.
_PUT_M, _PUT_RAD = 0.18, 0.5
#: Distance at which stands are passed, from their centres, m; without the box the target's stand is
#: passed nearer.
_ROUND_M, _ROUND_TARGET_M = 0.62, 0.5
#: Bound of the heading's weight in choosing the side of a stand, rad.
_SIDEWAYS_RAD = 1.6
#: Only stands within these distances are avoided, m; inside the first any way out is free.
_INSIDE_M, _AVOIDED_M = 0.3, 2.5
#: Length of a step without and with the box, m; largest turn of a step likewise, rad.
_STEP_M, _STEP_CARRYING_M = 0.45, 0.4
_TURN_RAD, _TURN_CARRYING_RAD = 0.6, 0.5
#: Steps have no length where the turn to make is this large, rad; a step of the second length has
#: no turn, m.
_TURNS_ONLY_RAD, _NO_TURN_M = 1.8, 0.9
#: Steps become shorter within this distance, m, down to the given fraction; without the box the
#: path ends this far beyond its goal, m.
_SLOW_M, _SLOWEST, _BEYOND_M = 0.8, 0.25, 0.05
_SLOW_CARRYING_M, _SLOWEST_CARRYING = 0.7, 0.3
#: Within these distances steps also go sideways and backwards, with the final heading, m.
_NEAR_M, _NEAR_CARRYING_M = 0.4, 0.3
#: Bounds of such steps: back and ahead, aside, m; turn, rad; and fractions of the way per step.
_CREEP_M, _ASIDE_M, _CREEP_TURN_RAD = (-0.15, 0.2), 0.06, 0.6
_CREEP_AHEAD, _CREEP_ASIDE = 0.8, 0.7
#: With the box within the first distance of its stand, steps go backwards by the second, m, before
#: a turn by more than the third, rad: the box would otherwise sweep the stand.
_LEAVES_M, _BACK_M, _LEAVES_RAD = 0.5, -0.24, 0.5


@dataclass(frozen=True)
class View:
    """Position of the character relative to box, stands and target; m, rad."""

    position: Tensor
    """[n, 2]: of the character, on the floor."""
    heading: Tensor
    """[n, 2]: of the feet."""
    yaw_rad: Tensor
    """[n]: likewise."""
    ahead: Tensor
    """[n, 2]: unit vector from the pick-up point to the box."""
    pick_up_point: Tensor
    """[n, 2]: where the character stands to pick the box up."""
    off_pick_up_m: Tensor
    """[n]: distance to it."""
    off_face_rad: Tensor
    """[n]: turn to face the box there."""
    left_m: Tensor
    """[n]: distance left until the box can be put down."""
    off_target_rad: Tensor
    """[n]: turn to face the target."""
    off_stand_m: Tensor
    """[n]: distance from the stand of the box's start."""

    def before(self, distance: float, turn: float) -> Tensor:
        """[n] bool: within these factors of the bounds of arrival at the pick-up point."""
        return (self.off_pick_up_m < _AT_M * distance) & (self.off_face_rad.abs() < _AT_RAD * turn)


def view(feet: Footing, heading: Tensor, box: BoxState, face: Tensor) -> View:
    """The view towards face `face` [n] of the box; heading [n, 2]: of the root."""
    position, yaw_rad = position_of(feet), torch.atan2(feet.heading[:, 1], feet.heading[:, 0])
    directions, points = stand_poses(box)
    rows = torch.arange(len(face))
    ahead, point = directions[rows, face], points[rows, face]
    facing = torch.atan2(ahead[:, 1], ahead[:, 0])
    way = box.target[:, :2] - position
    return View(
        position=position,
        heading=feet.heading,
        yaw_rad=yaw_rad,
        ahead=ahead,
        pick_up_point=point,
        off_pick_up_m=(point - position).norm(dim=1),
        off_face_rad=wrapped(facing - yaw_rad),
        left_m=way.norm(dim=1)
        - half_depth_m(box, heading).clamp_min(MIN_HALF_DEPTH_M)
        - _GAP_DOWN_M,
        off_target_rad=wrapped(torch.atan2(way[:, 1], way[:, 0]) - yaw_rad),
        off_stand_m=(position - box.start[:, :2]).norm(dim=1),
    )


def position_of(feet: Footing) -> Tensor:
    """[n, 2]: position of the character on these feet, m."""
    return feet.middle(-_BEHIND_M)


def choose(root: Tensor, box: BoxState, last: Tensor) -> Tensor:
    """[n]: the face of the box to approach; root [n, 2] m, last [n]: the last choice, or −1."""
    directions, points = stand_poses(box)
    from_box = (root - box.position[:, :2])[:, None]
    cost = (points - root[:, None]).norm(dim=2)
    cost = cost + DEPTH_COST * (half_depths(box) - MIN_HALF_DEPTH_M).clamp_min(0.0)
    cost = cost + _COST_ROUND * (from_box * directions).sum(dim=2).clamp_min(0.0)
    onward = (box.target - box.position)[:, :2]
    onward = onward / onward.norm(dim=1, keepdim=True).clamp_min(1e-6)
    turn = torch.acos((directions * onward[:, None]).sum(dim=2).clamp(-1.0, 1.0))
    cost = cost + _COST_TURN_M * turn
    kept = torch.arange(4) == last[:, None]
    return (cost - _KEEP_M * kept).argmin(dim=1)


def aligned(view: View, before: Tensor) -> Tensor:
    """[n] bool: the approach is straight before the face; before [n] bool: it was so far."""
    gap = view.pick_up_point - view.position
    along = (gap * view.ahead).sum(dim=1)
    aside = (rotations.turn_back(view.ahead, gap)[:, 1]).abs()
    facing = view.off_face_rad.abs() < torch.where(before, _FACING_RAD[1], _FACING_RAD[0])
    beside = aside < torch.where(before, _BESIDE_M[1], _BESIDE_M[0])
    return beside & facing & (along > -_PAST_M) & (along < _BEFORE_M + _SHORT_M)


def step_command(view: View, box: BoxState, carrying: Tensor, straight: Tensor) -> Tensor:
    """[n, 3]: the next step, ahead and to the left, m, and its turn, rad.

    carrying [n] bool: towards the target; straight [n] bool: where not carrying, straight on to the
    box.
    """
    point = view.pick_up_point
    goal = torch.where(straight[:, None], point, point - view.ahead * _BEFORE_M)
    way = goal - view.position
    far = torch.where(carrying, view.left_m, way.norm(dim=1))
    bearing = torch.where(carrying[:, None], box.target[:, :2] - view.position, way)
    turn = wrapped(_round(view, box, carrying, straight, bearing, far) - view.yaw_rad)
    turn = torch.where(straight & ~carrying, view.off_face_rad, turn)
    near = torch.where(carrying, far < _NEAR_CARRYING_M, (far < _NEAR_M) | straight)
    step = torch.where(near[:, None], _near(view, carrying, way, turn), _far(carrying, far, turn))
    leaves = carrying & (view.off_stand_m < _LEAVES_M) & (turn.abs() > _LEAVES_RAD)
    return torch.where(leaves[:, None], step.new_tensor((_BACK_M, 0.0, 0.0)), step)


def _round(
    view: View, box: BoxState, carrying: Tensor, straight: Tensor, way: Tensor, far_m: Tensor
) -> Tensor:
    """[n]: direction of travel past the stands, rad, for a way [n, 2] m."""
    wanted = torch.atan2(way[:, 1], way[:, 0])
    # the stand of the box or of its start, then that of the target
    first = torch.where(carrying[:, None], box.start, box.position)
    for stand_at, avoided, radius in (
        (first, carrying | ~straight, _ROUND_M),
        (box.target, ~carrying, _ROUND_TARGET_M),
    ):
        there = stand_at[:, :2] - view.position
        distance = there.norm(dim=1)
        towards = torch.atan2(there[:, 1], there[:, 0])
        off = wrapped(wanted - towards)
        half = torch.asin(radius / distance.clamp_min(radius + 1e-3))
        before = (distance < far_m) & (distance < _AVOIDED_M) & (distance > _INSIDE_M)
        blocked = avoided & before & (off.abs() < half)
        # pass on the side with less distance and turn. For a target right behind the stand the
        # distance alone alternates between the sides; the turn under way decides
        turned = wrapped(view.yaw_rad - towards).clamp(-_SIDEWAYS_RAD, _SIDEWAYS_RAD)
        past = towards + torch.where(off + turned >= 0.0, half, -half)
        wanted = torch.where(blocked, past, wanted)
    return wanted


def _far(carrying: Tensor, far_m: Tensor, turn: Tensor) -> Tensor:
    """[n, 3]: a step far from the goal: turn towards it and go ahead."""
    length = torch.where(carrying, _STEP_CARRYING_M, _STEP_M).double()
    length = length * (1.0 - turn.abs() / _TURNS_ONLY_RAD).clamp(0.0, 1.0)
    alone = ((far_m + _BEYOND_M) / _SLOW_M).clamp(_SLOWEST, 1.0)
    length = length * torch.where(
        carrying, (far_m / _SLOW_CARRYING_M).clamp(_SLOWEST_CARRYING, 1.0), alone
    )
    most = torch.where(carrying, _TURN_CARRYING_RAD, _TURN_RAD).double()
    turn = torch.maximum(torch.minimum(turn, most), -most) * (1.0 - length / _NO_TURN_M)
    return torch.stack((length, torch.zeros_like(length), turn), dim=1)


def _near(view: View, carrying: Tensor, way: Tensor, turn: Tensor) -> Tensor:
    """[n, 3]: a step near the goal: any direction [n, 2] m, with the final heading."""
    local = rotations.turn_back(view.heading, way)
    ahead = torch.where(carrying, view.left_m, local[:, 0])
    aside = torch.where(carrying, 0.0, local[:, 1])
    turn = torch.where(carrying, turn, view.off_face_rad)
    return torch.stack(
        (
            (_CREEP_AHEAD * ahead).clamp(*_CREEP_M),
            (_CREEP_ASIDE * aside).clamp(-_ASIDE_M, _ASIDE_M),
            turn.clamp(-_CREEP_TURN_RAD, _CREEP_TURN_RAD),
        ),
        dim=1,
    )


def arrived(view: View, carrying: Tensor, before: Tensor) -> Tensor:
    """[n] bool: the path has ended; before [n] bool: it had ended, which widens the bounds."""
    facing = view.off_target_rad.abs()
    done = (view.left_m < _DONE_M) & (facing < _DONE_RAD)
    stays = (view.left_m.abs() < _STAY_M) & (facing < _STAY_RAD)
    done = torch.where(carrying, done, view.before(1.0, 1.0))
    stays = torch.where(carrying, stays, view.before(_NEAR_ENOUGH, _STAYS_TURNED))
    return done | (before & stays)


def at_box(view: View) -> Tensor:
    """[n] bool: the box can be picked up from here."""
    return view.before(_NEAR_ENOUGH, _NEAR_ENOUGH)


def by_box(view: View) -> Tensor:
    """[n] bool: a stalled character tries to pick the box up from here."""
    return view.before(_BY_BOX, _BY_BOX)


def at_target(view: View) -> Tensor:
    """[n] bool: the box in hand can be put down from here."""
    return (view.left_m < _PUT_M) & (view.off_target_rad.abs() < _PUT_RAD)

"""Where a porter walks: which face of the box to stand before, the way round the stands, and what
the next step should be.

All functions are of the moment alone, but for what the porter keeps of its last choices.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from world import rotations
from world.objects.grasp import deep_m
from world.scene.target import BoxState
from world.tasks.carry import COST_DEEP, DEEP_M, depths, places_before
from world.teachers.gait import Footing, wrapped

#: A porter's place is so far behind the middle of the soles, m: about the ankles.
_BEHIND_M = 0.035
#: From the edge one stands this far to put it down, m.
_GAP_DOWN_M = 0.19
#: What a face costs besides the way to it and its depth, m: by each metre that one is behind it,
#: each radian that one would have to turn to the target then.
_COST_ROUND, _COST_TURN_M = 1.0, 0.3
#: A face that was chosen is kept unless another one is better by this, m.
_KEEP_M = 0.3
#: First one goes to a point so far before the place, and from there straight on, m.
_BEFORE_M = 0.15
#: One is before the face, facing it, within these, m and rad: the first to get there, the second to
#: be still there; and no further past the place or before that point than the last, m.
_BESIDE_M, _FACING_RAD, _PAST_M, _SHORT_M = (0.07, 0.27), (0.3, 0.7), 0.12, 0.3
#: One has arrived before the face within these, m and rad; is near enough to pick the box up within
#: so many times as much, and stays there within that much of the turn.
_AT_M, _AT_RAD = 0.14, 0.28
_NEAR_ENOUGH, _STAYS_TURNED = 1.5, 1.3
#: Who comes no nearer may try within so many times as much.
_BY_BOX = 2.8
#: Likewise with the box, before the target: m and rad.
_DONE_M, _DONE_RAD, _STAY_M, _STAY_RAD = 0.1, 0.3, 0.18, 0.5
#: From within these the box may be put down, m and rad.
_PUT_M, _PUT_RAD = 0.18, 0.5
#: Stands are passed at this distance from their middle, with the box or going round it, m; that of
#: the target without the box is passed nearer.
_ROUND_M, _ROUND_TARGET_M = 0.62, 0.5
#: Turned away from a stand by more than this, rad, one is no more on that side of it.
_SIDEWAYS_RAD = 1.6
#: Only stands within these are minded, m: from inside one gets out as one likes.
_INSIDE_M, _MINDED_M = 0.3, 2.5
#: Length of a step, alone and with the box, m; most that one turns with it, likewise, rad.
_STEP_M, _STEP_LADEN_M = 0.45, 0.4
_TURN_RAD, _TURN_LADEN_RAD = 0.6, 0.5
#: Who must turn by this goes no further meanwhile, rad; a full turn and such a step, m, exclude
#: each other.
_TURNS_ONLY_RAD, _NO_TURN_M = 1.8, 0.9
#: Steps become shorter from so far off, m, down to the share; alone, one stops beyond the way's end
#: by that much.
_SLOW_M, _SLOWEST, _BEYOND_M = 0.8, 0.25, 0.05
_SLOW_LADEN_M, _SLOWEST_LADEN = 0.7, 0.3
#: This near one goes sideways and backwards too, m, with the heading that one should have then.
_NEAR_M, _NEAR_LADEN_M = 0.4, 0.3
#: Such steps: back and ahead, aside, m; turned, rad; as shares of the way ahead and aside.
_CREEP_M, _ASIDE_M, _CREEP_TURN_RAD = (-0.15, 0.2), 0.06, 0.6
_CREEP_AHEAD, _CREEP_ASIDE = 0.8, 0.7
#: With the box this near to its stand one goes backwards, by such steps, m, before one turns by
#: more than that, rad: the box would sweep the stand.
_LEAVES_M, _BACK_M, _LEAVES_RAD = 0.5, -0.24, 0.5


@dataclass(frozen=True)
class View:
    """What a porter sees of its way, from where it stands; m, rad."""

    place: Tensor
    """[n, 2]: of the porter, on the floor."""
    heading: Tensor
    """[n, 2]: of its feet."""
    yaw_rad: Tensor
    """[n]: likewise."""
    ahead: Tensor
    """[n, 2]: unit vector from the place to pick the box up from to the box."""
    spot: Tensor
    """[n, 2]: that place."""
    off_spot_m: Tensor
    """[n]: to it."""
    off_face_rad: Tensor
    """[n]: to face the box there."""
    left_m: Tensor
    """[n]: to go until the box can be put down."""
    off_target_rad: Tensor
    """[n]: to face the target."""
    off_stand_m: Tensor
    """[n]: from the stand that the box comes from."""

    def before(self, place: float, turn: float) -> Tensor:
        """[n] bool: within these times the bounds at the place to pick the box up from."""
        return (self.off_spot_m < _AT_M * place) & (self.off_face_rad.abs() < _AT_RAD * turn)


def view(feet: Footing, heading: Tensor, box: BoxState, face: Tensor) -> View:
    """With the box before the face `face` [n] of it; heading [n, 2]: of the root."""
    place, yaw_rad = stand(feet), torch.atan2(feet.heading[:, 1], feet.heading[:, 0])
    directions, spots = places_before(box)
    rows = torch.arange(len(face))
    ahead, spot = directions[rows, face], spots[rows, face]
    facing = torch.atan2(ahead[:, 1], ahead[:, 0])
    way = box.target[:, :2] - place
    return View(
        place=place,
        heading=feet.heading,
        yaw_rad=yaw_rad,
        ahead=ahead,
        spot=spot,
        off_spot_m=(spot - place).norm(dim=1),
        off_face_rad=wrapped(facing - yaw_rad),
        left_m=way.norm(dim=1) - deep_m(box, heading).clamp_min(DEEP_M) - _GAP_DOWN_M,
        off_target_rad=wrapped(torch.atan2(way[:, 1], way[:, 0]) - yaw_rad),
        off_stand_m=(place - box.start[:, :2]).norm(dim=1),
    )


def stand(feet: Footing) -> Tensor:
    """[n, 2]: the place of who stands on these feet, m."""
    return feet.middle(-_BEHIND_M)


def choose(root: Tensor, box: BoxState, last: Tensor) -> Tensor:
    """[n]: the face to pick the box up before; root [n, 2] m, last [n]: the last choice, or −1."""
    directions, spots = places_before(box)
    from_box = (root - box.position[:, :2])[:, None]
    cost = (spots - root[:, None]).norm(dim=2)
    cost = cost + COST_DEEP * (depths(box) - DEEP_M).clamp_min(0.0)
    cost = cost + _COST_ROUND * (from_box * directions).sum(dim=2).clamp_min(0.0)
    onward = (box.target - box.position)[:, :2]
    onward = onward / onward.norm(dim=1, keepdim=True).clamp_min(1e-6)
    turn = torch.acos((directions * onward[:, None]).sum(dim=2).clamp(-1.0, 1.0))
    cost = cost + _COST_TURN_M * turn
    kept = torch.arange(4) == last[:, None]
    return (cost - _KEEP_M * kept).argmin(dim=1)


def aligned(view: View, before: Tensor) -> Tensor:
    """[n] bool: straight before the face, on the last metres to it; before [n] bool: so far."""
    gap = view.spot - view.place
    along = (gap * view.ahead).sum(dim=1)
    aside = (rotations.turn_back(view.ahead, gap)[:, 1]).abs()
    facing = view.off_face_rad.abs() < torch.where(before, _FACING_RAD[1], _FACING_RAD[0])
    beside = aside < torch.where(before, _BESIDE_M[1], _BESIDE_M[0])
    return beside & facing & (along > -_PAST_M) & (along < _BEFORE_M + _SHORT_M)


def wish(view: View, box: BoxState, laden: Tensor, straight: Tensor) -> Tensor:
    """[n, 3]: how far the next step should go ahead and to the left, m, and turn, rad.

    laden [n] bool: the box is carried to its target; straight [n] bool: who is not has only to go
    straight on to it.
    """
    goal = torch.where(straight[:, None], view.spot, view.spot - view.ahead * _BEFORE_M)
    way = goal - view.place
    far = torch.where(laden, view.left_m, way.norm(dim=1))
    bearing = torch.where(laden[:, None], box.target[:, :2] - view.place, way)
    turn = wrapped(_round(view, box, laden, straight, bearing, far) - view.yaw_rad)
    turn = torch.where(straight & ~laden, view.off_face_rad, turn)
    near = torch.where(laden, far < _NEAR_LADEN_M, (far < _NEAR_M) | straight)
    step = torch.where(near[:, None], _near(view, laden, way, turn), _far(laden, far, turn))
    leaves = laden & (view.off_stand_m < _LEAVES_M) & (turn.abs() > _LEAVES_RAD)
    return torch.where(leaves[:, None], step.new_tensor((_BACK_M, 0.0, 0.0)), step)


def _round(
    view: View, box: BoxState, laden: Tensor, straight: Tensor, way: Tensor, far_m: Tensor
) -> Tensor:
    """[n]: the direction in which to go, rad, for a way [n, 2] m, past the stands."""
    wanted = torch.atan2(way[:, 1], way[:, 0])
    # the stand that the box is on, or was; and that of the target
    first = torch.where(laden[:, None], box.start, box.position)
    for stand_at, minded, radius in (
        (first, laden | ~straight, _ROUND_M),
        (box.target, ~laden, _ROUND_TARGET_M),
    ):
        there = stand_at[:, :2] - view.place
        distance = there.norm(dim=1)
        towards = torch.atan2(there[:, 1], there[:, 0])
        off = wrapped(wanted - towards)
        half = torch.asin(radius / distance.clamp_min(radius + 1e-3))
        before = (distance < far_m) & (distance < _MINDED_M) & (distance > _INSIDE_M)
        blocked = minded & before & (off.abs() < half)
        # on the side on which less is to be gone and turned. Of a target right behind the stand the
        # way alone would say now this side, now that one; who has begun to turn goes on
        turned = wrapped(view.yaw_rad - towards).clamp(-_SIDEWAYS_RAD, _SIDEWAYS_RAD)
        past = towards + torch.where(off + turned >= 0.0, half, -half)
        wanted = torch.where(blocked, past, wanted)
    return wanted


def _far(laden: Tensor, far_m: Tensor, turn: Tensor) -> Tensor:
    """[n, 3]: a step for who faces his way and goes."""
    length = torch.where(laden, _STEP_LADEN_M, _STEP_M).double()
    length = length * (1.0 - turn.abs() / _TURNS_ONLY_RAD).clamp(0.0, 1.0)
    alone = ((far_m + _BEYOND_M) / _SLOW_M).clamp(_SLOWEST, 1.0)
    length = length * torch.where(laden, (far_m / _SLOW_LADEN_M).clamp(_SLOWEST_LADEN, 1.0), alone)
    most = torch.where(laden, _TURN_LADEN_RAD, _TURN_RAD).double()
    turn = torch.maximum(torch.minimum(turn, most), -most) * (1.0 - length / _NO_TURN_M)
    return torch.stack((length, torch.zeros_like(length), turn), dim=1)


def _near(view: View, laden: Tensor, way: Tensor, turn: Tensor) -> Tensor:
    """[n, 3]: a step for who is about there: any way [n, 2] m, with the last heading already."""
    seen = rotations.turn_back(view.heading, way)
    ahead = torch.where(laden, view.left_m, seen[:, 0])
    aside = torch.where(laden, 0.0, seen[:, 1])
    turn = torch.where(laden, turn, view.off_face_rad)
    return torch.stack(
        (
            (_CREEP_AHEAD * ahead).clamp(*_CREEP_M),
            (_CREEP_ASIDE * aside).clamp(-_ASIDE_M, _ASIDE_M),
            turn.clamp(-_CREEP_TURN_RAD, _CREEP_TURN_RAD),
        ),
        dim=1,
    )


def arrived(view: View, laden: Tensor, before: Tensor) -> Tensor:
    """[n] bool: where the way ends; before [n] bool: so far, when it takes more to go on."""
    facing = view.off_target_rad.abs()
    done = (view.left_m < _DONE_M) & (facing < _DONE_RAD)
    stays = (view.left_m.abs() < _STAY_M) & (facing < _STAY_RAD)
    done = torch.where(laden, done, view.before(1.0, 1.0))
    stays = torch.where(laden, stays, view.before(_NEAR_ENOUGH, _STAYS_TURNED))
    return done | (before & stays)


def at_box(view: View) -> Tensor:
    """[n] bool: the box may be picked up from here."""
    return view.before(_NEAR_ENOUGH, _NEAR_ENOUGH)


def by_box(view: View) -> Tensor:
    """[n] bool: it may be tried from here."""
    return view.before(_BY_BOX, _BY_BOX)


def at_target(view: View) -> Tensor:
    """[n] bool: the box in hand may be put down from here."""
    return (view.left_m < _PUT_M) & (view.off_target_rad.abs() < _PUT_RAD)

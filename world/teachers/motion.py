"""One control step of the whole body: what feet, mass, trunk, hands and joints should do, weighed
against one another, and the servo targets that do it.

A servo with target q + s moves towards it at s kp / kd, so that a velocity is asked for as the move
of one time constant kd / kp, which is 0.1 s for all of them.
"""

from dataclasses import dataclass, fields
from typing import TypeVar

import torch
from torch import Tensor

from world.character import model as character
from world.character import servos
from world.objects.grasp import shortened
from world.teachers.gait import ANKLE_M, CONTROL_S, FEET, OMEGA, Footing, Stride, unit
from world.teachers.phase_cue import NECK
from world.teachers.whole_body import (
    BODY_KG,
    GRAVITY_M_S2,
    Figure,
    Mass,
    Tasks,
    attitude,
    moments,
    targets,
    way_round,
)

_BODY = character.BODIES.index
_PELVIS, _TORSO = _BODY("pelvis"), _BODY("torso")
#: Right first.
HANDS = (_BODY("right_hand"), _BODY("left_hand"))
_ELBOWS = (_BODY("right_lower_arm"), _BODY("left_lower_arm"))
_SHOULDERS = (_BODY("right_upper_arm"), _BODY("left_upper_arm"))
_OUTWARD = (-1.0, 1.0)
_NOMINAL = servos.coordinates(torch.from_numpy(character.standing_qpos())[None])[0]
_ARMS, _KNEES = slice(6, 14), [17, 24]
#: kd / kp of every servo, s.
SERVO_S = 0.1

# What a metre amiss is worth; a radian, of the feet, the share named.
#: Feet that stand hold all else up; one in the air may give way a little.
_FOOT, _FOOT_IN_AIR, _FOOT_TURN = 60.0, 30.0, 0.6
#: The mass, walking and standing: there it has to make way for what the hands lift.
_MASS, _MASS_STANDS, _HAND, _ELBOW = 12.0, 24.0, 12.0, 12.0
#: Trunk and height: walking, and standing over a box.
_TRUNK_WALKS, _HEIGHT_WALKS = 8.0, 10.0
_TRUNK, _HEIGHT = 4.0, 6.0
#: Joints keep about the pose of a stand. Arms are for the hands to move; knees that stand bend
#: last, so that a low box is reached with the hips.
_JOINT, _ARM, _KNEE = 1.0, 0.7, 3.0
#: So much of the way back to that pose is asked for at once, and at most this, rad.
_POSE, _POSE_RAD = 0.05, 0.05
#: The neck of who walks tells something: so many times the way to there is asked for at once, of
#: which it makes the most within one control step; of the way back of who stands, that share; at
#: most the last, rad.
_NECK, _NECK_WAY, _NECK_BACK, _NECK_RAD = 8.0, 2.0, 0.2, 0.4

#: The mass stands so far behind the middle of the soles, m: before the ankles, where both ways of
#: falling are as near.
_STANDS_M = 0.02 - 0.045
#: Standing, pressure moves beyond the mass by these times what is amiss with its place, and its
#: velocity, s: as a spring and a damper.
_PRESS, _PRESS_S = 1.0, 0.45
#: No farther from the line between the soles than this, m: half of a foot.
_SOLE_M = 0.08
#: Of a move that is asked for, standing servos are told this share; the rest would overshoot.
_GAIN_STANDS = 0.65
#: A turning foot is brought round at this rate, 1/s, a trunk that walks at that, at most so much at
#: once, rad. It leans forward a little, the pelvis half of it.
_FOOT_HZ, _TRUNK_HZ, _TRUNK_RAD, _LEAN_RAD, _LEAN_PELVIS = 8.0, 8.0, 0.2, 0.08, 0.5
#: A walker's height is mended by at most this at once, m.
_HEIGHT_M = 0.03
#: Over things that are lower than the first, m, the trunk bends by so much a metre, rad/m, up to
#: the third, rad, before it is known whether the arms reach them.
_UPRIGHT_M, _BEND_RAD_M, _BENT_RAD = 0.95, 1.6, 1.0
#: It bends on while the hands' goals are farther than this from the shoulders, m, at most by so
#: much at once, and altogether, rad; the pelvis takes its share.
_EASY_M, _BEND_ON_RAD, _BENT_MOST_RAD, _PELVIS_SHARE = 0.42, 0.05, 1.1, 0.6
#: With the box in hand it comes up by so much at once, rad, once the legs are this straight, m:
#: before, they do the lifting.
_UNBEND_RAD, _RISEN_M = 0.05, 0.84
#: Bends are asked for by at most this at once, rad, and the pelvis comes up to its standing height
#: by at most that, m.
_BEND_RAD, _TALL_M, _RISE_M = 0.05, 0.88, 0.03
#: The elbows keep this far outside the planes of the faces that the hands press on, m, which they
#: take up by at most so much at once.
_OUTSIDE_M, _OUTSIDE_STEP_M = 0.05, 0.04


@dataclass(frozen=True)
class Reach:
    """What the hands should do, right first."""

    led: Tensor
    """[n] bool: whether they are told anything."""
    pressing: Tensor
    """[n] bool: they hold the box between them, to lift or carry it."""
    step: Tensor
    """[n, 2, 3]: how far to move next, m."""
    force: Tensor
    """[n, 2, 3]: what to press with, N."""
    goal: Tensor
    """[n, 2, 3]: where to get in the end, m, for which the trunk bends."""
    height_m: Tensor
    """[n]: how high what they reach for is."""
    left: Tensor
    """[n, 3]: horizontal unit vector from the right face of it to the left one."""
    faces: Tensor
    """[n, 2, 3]: a point of either face, m."""


@dataclass(frozen=True)
class Pace:
    """How the body goes while it walks."""

    height_m: Tensor
    """[n]: of the pelvis."""
    velocity: Tensor
    """[n, 2]: with which the hands go along, m/s."""
    neck: Tensor
    """[n, 3]: where the neck goes, rad, as its servos measure it; of who stands it rests."""


@dataclass(frozen=True)
class Intent:
    """What the bodies of n scenes are to do in the next control step, and where they are."""

    figure: Figure
    feet: Footing
    mass: Mass
    stride: Stride
    reach: Reach
    pace: Pace

    def rows(self, ids: Tensor) -> "Intent":
        """Of the scenes `ids` [m] alone: that is cheaper."""
        return Intent(**{name: _rows(part, ids) for name, part in vars(self).items()})

    def targets(self) -> Tensor:
        """Servo targets [n, 28] rad."""
        parts = (self.figure, self.feet, self.mass, self.stride, self.reach, self.pace)
        return move(*parts)


_Part = TypeVar("_Part", Figure, Footing, Mass, Stride, Reach, Pace)


def _rows(part: _Part, ids: Tensor) -> _Part:
    names = (field.name for field in fields(part))
    return type(part)(**{name: getattr(part, name)[ids] for name in names})


def move(
    figure: Figure, feet: Footing, mass: Mass, stride: Stride, reach: Reach, pace: Pace
) -> Tensor:
    """Servo targets [n, 28] rad of the next control step."""
    tasks = Tasks()
    _feet(tasks, figure, feet, stride)
    pressure, push = _balance(tasks, figure, feet, stride, mass)
    _walk(tasks, figure, feet, stride, pace)
    _bend(tasks, figure, feet, stride, reach)
    _hands(tasks, figure, stride, reach, pace)
    _pose(tasks, figure, stride, pace)
    effort = _effort(figure, feet, stride, mass, pressure, push)
    for side, hand in enumerate(HANDS):
        effort = effort + moments(figure.point_jacobian(hand), reach.force[:, side])
    gain = torch.where(stride.stands, _GAIN_STANDS, 1.0)
    return targets(figure, tasks.solve(), effort, gain)


def resting(feet: Footing) -> Tensor:
    """[n, 2]: where the mass of those who stand should be, m."""
    return feet.middle(_STANDS_M)


def _feet(tasks: Tasks, figure: Figure, feet: Footing, stride: Stride) -> None:
    """Flat and on the floor, but for the one that swings."""
    for side, foot in enumerate(FEET):
        air = stride.air[:, side]
        weight = torch.where(air, _FOOT_IN_AIR, _FOOT)
        yaw_rad = torch.where(air, stride.yaw_rad, feet.yaw_rad[:, side])
        flat = attitude(unit(yaw_rad), torch.zeros_like(yaw_rad))
        turn = way_round(figure.rotation[:, foot], flat)
        turn = turn * torch.where(air, _FOOT_HZ * SERVO_S, 1.0)[:, None]
        tasks.add(figure.turning_jacobian(foot), turn, weight * _FOOT_TURN)
        sunk = torch.zeros_like(turn)
        sunk[:, 2] = ANKLE_M - feet.ankles[:, side, 2]
        step = torch.where(air[:, None], stride.velocity * SERVO_S, sunk)
        tasks.add(figure.point_jacobian(foot), step, weight)


def _balance(
    tasks: Tasks, figure: Figure, feet: Footing, stride: Stride, mass: Mass
) -> tuple[Tensor, Tensor]:
    """Standing, the mass goes where it rests; walking, as the pressure of the floor makes it fall.
    That pressure [n, 2], m, and the acceleration that comes of it [n, 2], m/s²."""
    stands = stride.stands[:, None]
    amiss = resting(feet) - mass.position
    held = mass.position - _PRESS * amiss + _PRESS_S * mass.velocity
    falls = OMEGA**2 * (mass.position - stride.pressure)
    wanted = torch.where(stands, amiss, (mass.velocity + falls * CONTROL_S) * SERVO_S)
    # the load comes along with the body's share alone
    share = (mass.mass_kg / BODY_KG)[:, None]
    weight = torch.where(stride.stands, _MASS_STANDS, _MASS)
    tasks.add(figure.com_jacobian[:, :2], wanted * share, weight)
    return torch.where(stands, held, stride.pressure), torch.where(stands, 0.0, falls)


def _walk(tasks: Tasks, figure: Figure, feet: Footing, stride: Stride, pace: Pace) -> None:
    """A walker's trunk faces where the feet do, and the pelvis keeps its height."""
    walks = (~stride.stands).double()
    lean = torch.full_like(walks, _LEAN_RAD)
    ahead = _facing(feet, stride)
    for body, share in ((_PELVIS, _LEAN_PELVIS), (_TORSO, 1.0)):
        turn = way_round(figure.rotation[:, body], attitude(ahead, lean * share))
        turn = shortened(turn, _TRUNK_RAD) * (_TRUNK_HZ * SERVO_S)
        tasks.add(figure.turning_jacobian(body), turn, _TRUNK_WALKS * walks)
    rise = (pace.height_m - figure.position[:, _PELVIS, 2]).clamp(-_HEIGHT_M, _HEIGHT_M)
    tasks.add(figure.point_jacobian(_PELVIS)[:, 2:], rise[:, None], _HEIGHT_WALKS * walks)


def _facing(feet: Footing, stride: Stride) -> Tensor:
    """[n, 2]: unit vector between the ways that the feet point, once the one in the air is where
    it should be."""
    yaw_rad = torch.where(stride.air, stride.yaw_rad[:, None], feet.yaw_rad)
    ahead = unit(yaw_rad).sum(dim=1)
    return ahead / ahead.norm(dim=1, keepdim=True)


def _bend(tasks: Tasks, figure: Figure, feet: Footing, stride: Stride, reach: Reach) -> None:
    """Who stands bends as far as the hands need, and comes up with what they hold."""
    pitch = _pitch(figure, feet, reach)
    weight = _TRUNK * stride.stands
    for body, share in ((_PELVIS, _PELVIS_SHARE), (_TORSO, 1.0)):
        turn = way_round(figure.rotation[:, body], attitude(feet.heading, pitch * share))
        tasks.add(figure.turning_jacobian(body), shortened(turn, _BEND_RAD), weight)
    rise = (_TALL_M - figure.position[:, _PELVIS, 2]).clamp(0.0, _RISE_M)
    up = (reach.pressing | ~reach.led) & stride.stands
    tasks.add(figure.point_jacobian(_PELVIS)[:, 2:], rise[:, None], _HEIGHT * up)


def _pitch(figure: Figure, feet: Footing, reach: Reach) -> Tensor:
    """[n]: how far the trunk should bend forward next, rad."""
    up = figure.rotation[:, _TORSO, :, 2]
    now = torch.atan2((up[:, :2] * feet.heading).sum(dim=1), up[:, 2])
    low = ((_UPRIGHT_M - reach.height_m) * _BEND_RAD_M).clamp(0.0, _BENT_RAD)
    far = (reach.goal - figure.position[:, _SHOULDERS]).norm(dim=2).mean(dim=1) - _EASY_M
    down = torch.maximum(low, now + far.clamp(-_BEND_ON_RAD, _BEND_ON_RAD))
    # the legs lift before the back does
    kept = torch.where(figure.position[:, _PELVIS, 2] < _RISEN_M, low, 0.0)
    back = torch.maximum(kept, now - _UNBEND_RAD)
    pitch = torch.where(reach.pressing, back, down.clamp(0.0, _BENT_MOST_RAD))
    return torch.where(reach.led, pitch, 0.0)


def _hands(tasks: Tasks, figure: Figure, stride: Stride, reach: Reach, pace: Pace) -> None:
    """The hands go where they are led, along with a walker; the elbows stay outside of what is
    between them."""
    along = torch.where(stride.stands[:, None], 0.0, pace.velocity * SERVO_S)
    along = torch.cat((along, torch.zeros_like(along[:, :1])), dim=1)
    for side, (hand, elbow, sign) in enumerate(zip(HANDS, _ELBOWS, _OUTWARD, strict=True)):
        outward = sign * reach.left
        off = ((figure.position[:, elbow] - reach.faces[:, side]) * outward).sum(dim=1)
        out = (_OUTSIDE_M - off).clamp(0.0, _OUTSIDE_STEP_M)
        row = (figure.point_jacobian(elbow) * outward[:, :, None]).sum(dim=1, keepdim=True)
        tasks.add(row, out[:, None], _ELBOW * reach.led)
        tasks.add(figure.point_jacobian(hand), reach.step[:, side] + along, _HAND * reach.led)


def _pose(tasks: Tasks, figure: Figure, stride: Stride, pace: Pace) -> None:
    """The joints tend to a relaxed stand, but for a walker's neck."""
    here = servos.coordinates(figure.qpos)
    back = (_POSE * (_NOMINAL - here)).clamp(-_POSE_RAD, _POSE_RAD)
    weight = torch.full_like(back, _JOINT)
    weight[:, _ARMS] = _ARM
    weight[:, _KNEES] = torch.where(stride.stands, _KNEE, _JOINT)[:, None].double()
    walks = ~stride.stands[:, None]
    told, rest = pace.neck - here[:, NECK], (_NOMINAL - here)[:, NECK]
    told = torch.where(walks, _NECK_WAY * told, _NECK_BACK * rest)
    back[:, NECK] = told.clamp(-_NECK_RAD, _NECK_RAD)
    weight[:, NECK] = torch.where(walks, _NECK, weight[:, NECK])
    jacobian = torch.eye(character.NV, dtype=back.dtype)[6:].expand(len(back), -1, -1)
    tasks.add(jacobian, back, weight)


def _effort(
    figure: Figure, feet: Footing, stride: Stride, mass: Mass, pressure: Tensor, push: Tensor
) -> Tensor:
    """[n, 34]: what the joints must exert, N·m, to hold the mass and accelerate it by `push`
    [n, 2], m/s², where the floor pushes at `pressure` [n, 2], m: with both feet about the point of
    the line between them that is next to it."""
    right, left = feet.soles[:, 0, :2], feet.soles[:, 1, :2]
    line = left - right
    share = ((pressure - right) * line).sum(dim=1) / line.square().sum(dim=1).clamp_min(1e-4)
    share = torch.where(stride.air[:, 1], 0.0, torch.where(stride.air[:, 0], 1.0, share))
    share = share.clamp(0.0, 1.0)
    beside = pressure - right - share[:, None] * line
    beside = shortened(beside, _SOLE_M)
    force = torch.cat((push, torch.full_like(push[:, :1], GRAVITY_M_S2)), dim=1)
    effort = moments(figure.com_jacobian, BODY_KG * force)
    for side, (foot, part) in enumerate(zip(FEET, (1.0 - share, share), strict=True)):
        point = feet.soles[:, side, :2] + beside
        point = torch.cat((point, torch.zeros_like(point[:, :1])), dim=1)
        borne = (part * mass.mass_kg)[:, None] * force
        effort = effort - moments(figure.point_jacobian(foot, point), borne)
    return effort

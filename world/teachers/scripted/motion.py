"""One control step of the whole body: weighted tasks of feet, mass, trunk, hands and joints, and
the servo set-points that carry them out.

A servo with the set-point q + s moves at s kp / kd. A velocity is therefore requested as the move
over one time constant kd / kp, which is 0.1 s for all servos.
"""

from dataclasses import dataclass, fields
from typing import TypeVar

import torch
from torch import Tensor

from world.character import model as character
from world.character import servos
from world.teachers.scripted.gait import ANKLE_M, CONTROL_S, FEET, OMEGA, Footing, Stride, unit
from world.teachers.scripted.phase_cue import NECK
from world.teachers.scripted.whole_body import (
    BODY_KG,
    GRAVITY_M_S2,
    Figure,
    Mass,
    Tasks,
    attitude,
    moments,
    rotation_error,
    set_points,
    shortened,
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

# Weights per metre of error; per radian for turns; _FOOT_TURN scales the feet's weight for turns.
#: Stance feet support everything else; a swing foot may yield a little.
_FOOT, _FOOT_IN_AIR, _FOOT_TURN = 60.0, 30.0, 0.6
#: The mass, walking and standing, where it has to balance what the hands lift; hands and elbows.
_MASS, _MASS_STANDS, _HAND, _ELBOW = 12.0, 24.0, 12.0, 12.0
#: Trunk and height, walking and standing at a box.
_TRUNK_WALKS, _HEIGHT_WALKS = 8.0, 10.0
_TRUNK, _HEIGHT = 4.0, 6.0
#: Joints stay near the standing pose. Arms yield to the hands; the knees of a standing character
#: bend last, so that the hips reach a low box.
_JOINT, _ARM, _KNEE = 1.0, 0.7, 3.0
#: Fraction of the way back to that pose in one step, and its bound, rad.
_POSE, _POSE_RAD = 0.05, 0.05
#: The neck shows the phase cue while walking. Its weight; the factor on the way to the cue, most of
#: which it then covers in one control step; the fraction of the way back while standing; the bound
#: of either, rad.
_NECK, _NECK_WAY, _NECK_BACK, _NECK_RAD = 8.0, 2.0, 0.2, 0.4

#: Standing position of the mass relative to the soles' centre, m: before the ankles, with equal
#: margins ahead and back.
_STANDS_M = 0.02 - 0.045
#: Standing, the centre of pressure passes the mass by these factors of its position error and its
#: velocity, s: a spring and a damper.
_PRESS, _PRESS_S = 1.0, 0.45
#: Largest distance of the pressure from the line between the soles, m: half a foot.
_SOLE_M = 0.08
#: Gain on the requested move while standing; more overshoots.
_GAIN_STANDS = 0.65
#: Rates at which the foot and the walking trunk turn, 1/s, and the bound of the trunk's turn in one
#: step, rad. The walking trunk leans forward, rad; the pelvis takes the given fraction.
_FOOT_HZ, _TRUNK_HZ, _TRUNK_RAD, _LEAN_RAD, _LEAN_PELVIS = 8.0, 8.0, 0.2, 0.08, 0.5
#: Largest correction of the walking height in one step, m.
_HEIGHT_M = 0.03
#: Below the first height, m, the trunk bends by this angle per metre, rad/m, up to the third, rad,
#: whether or not the arms need it.
_UPRIGHT_M, _BEND_RAD_M, _BENT_RAD = 0.95, 1.6, 1.0
#: It bends further while the hands' goals are farther than this from the shoulders, m, at most by
#: this much in one step and in total, rad; the pelvis takes the given fraction.
_EASY_M, _BEND_ON_RAD, _BENT_MOST_RAD, _PELVIS_SHARE = 0.42, 0.05, 1.1, 0.6
#: With the box in hand the trunk rises by this much a step, rad, once the pelvis is this high, m:
#: the legs lift first.
_UNBEND_RAD, _RISEN_M = 0.05, 0.84
#: Bounds in one step: of the trunk's turn, rad, and of the pelvis' rise, m, to its standing height,
#: m.
_BEND_RAD, _TALL_M, _RISE_M = 0.05, 0.88, 0.03
#: Distance of the elbows outside the planes of the pressed faces, m, and the bound of its
#: correction in one step, m.
_OUTSIDE_M, _OUTSIDE_STEP_M = 0.05, 0.04


@dataclass(frozen=True)
class Reach:
    """What the hands do, right first."""

    active: Tensor
    """[n] bool: the hands have a goal."""
    pressing: Tensor
    """[n] bool: they press on the box to lift or carry it."""
    step: Tensor
    """[n, 2, 3]: the next move, m."""
    force: Tensor
    """[n, 2, 3]: force to exert, N."""
    goal: Tensor
    """[n, 2, 3]: final positions, m, for which the trunk bends."""
    height_m: Tensor
    """[n]: height of the object of the reach."""
    left: Tensor
    """[n, 3]: horizontal unit vector from its right face to its left one."""
    faces: Tensor
    """[n, 2, 3]: a point of each face, m."""


@dataclass(frozen=True)
class Pace:
    """Height, velocity and phase cue of walking."""

    height_m: Tensor
    """[n]: of the pelvis."""
    velocity: Tensor
    """[n, 2]: velocity of the root that the hands follow, m/s."""
    neck: Tensor
    """[n, 3]: phase cue, set-point of the neck in the coordinates of its servos, rad; unused where
    the character stands."""


@dataclass(frozen=True)
class Intent:
    """What the bodies of n scenes do in the next control step, and their state."""

    figure: Figure
    feet: Footing
    mass: Mass
    stride: Stride
    reach: Reach
    pace: Pace

    def rows(self, ids: Tensor) -> "Intent":
        """The scenes `ids` [m] alone: solving for fewer costs less."""
        return Intent(**{name: _rows(part, ids) for name, part in vars(self).items()})

    def set_points(self) -> Tensor:
        """Servo set-points [n, 28] rad."""
        parts = (self.figure, self.feet, self.mass, self.stride, self.reach, self.pace)
        return move(*parts)


_Part = TypeVar("_Part", Figure, Footing, Mass, Stride, Reach, Pace)


def _rows(part: _Part, ids: Tensor) -> _Part:
    names = (field.name for field in fields(part))
    return type(part)(**{name: getattr(part, name)[ids] for name in names})


def move(
    figure: Figure, feet: Footing, mass: Mass, stride: Stride, reach: Reach, pace: Pace
) -> Tensor:
    """Servo set-points [n, 28] rad of the next control step."""
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
    gain = torch.where(stride.standing, _GAIN_STANDS, 1.0)
    return set_points(figure, tasks.solve(), effort, gain)


def resting(feet: Footing) -> Tensor:
    """[n, 2]: target of the mass while standing, m."""
    return feet.middle(_STANDS_M)


def _feet(tasks: Tasks, figure: Figure, feet: Footing, stride: Stride) -> None:
    """Stance feet stay flat on the floor; the swing foot follows its path."""
    for side, foot in enumerate(FEET):
        air = stride.air[:, side]
        weight = torch.where(air, _FOOT_IN_AIR, _FOOT)
        yaw_rad = torch.where(air, stride.yaw_rad, feet.yaw_rad[:, side])
        flat = attitude(unit(yaw_rad), torch.zeros_like(yaw_rad))
        turn = rotation_error(figure.rotation[:, foot], flat)
        turn = turn * torch.where(air, _FOOT_HZ * SERVO_S, 1.0)[:, None]
        tasks.add(figure.turning_jacobian(foot), turn, weight * _FOOT_TURN)
        sunk = torch.zeros_like(turn)
        sunk[:, 2] = ANKLE_M - feet.ankles[:, side, 2]
        step = torch.where(air[:, None], stride.velocity * SERVO_S, sunk)
        tasks.add(figure.point_jacobian(foot), step, weight)


def _balance(
    tasks: Tasks, figure: Figure, feet: Footing, stride: Stride, mass: Mass
) -> tuple[Tensor, Tensor]:
    """Standing, the mass returns to its target; walking, it accelerates away from the centre of
    pressure. Returns that centre [n, 2], m, and the acceleration [n, 2], m/s²."""
    stands = stride.standing[:, None]
    error = resting(feet) - mass.position
    held = mass.position - _PRESS * error + _PRESS_S * mass.velocity
    falls = OMEGA**2 * (mass.position - stride.pressure)
    wanted = torch.where(stands, error, (mass.velocity + falls * CONTROL_S) * SERVO_S)
    # only the body's share of the mass is moved by its joints
    share = (mass.mass_kg / BODY_KG)[:, None]
    weight = torch.where(stride.standing, _MASS_STANDS, _MASS)
    tasks.add(figure.com_jacobian[:, :2], wanted * share, weight)
    return torch.where(stands, held, stride.pressure), torch.where(stands, 0.0, falls)


def _walk(tasks: Tasks, figure: Figure, feet: Footing, stride: Stride, pace: Pace) -> None:
    """Walking, the trunk faces the direction of the feet and the pelvis keeps its height."""
    walks = (~stride.standing).double()
    lean = torch.full_like(walks, _LEAN_RAD)
    ahead = _facing(feet, stride)
    for body, share in ((_PELVIS, _LEAN_PELVIS), (_TORSO, 1.0)):
        turn = rotation_error(figure.rotation[:, body], attitude(ahead, lean * share))
        turn = shortened(turn, _TRUNK_RAD) * (_TRUNK_HZ * SERVO_S)
        tasks.add(figure.turning_jacobian(body), turn, _TRUNK_WALKS * walks)
    rise = (pace.height_m - figure.position[:, _PELVIS, 2]).clamp(-_HEIGHT_M, _HEIGHT_M)
    tasks.add(figure.point_jacobian(_PELVIS)[:, 2:], rise[:, None], _HEIGHT_WALKS * walks)


def _facing(feet: Footing, stride: Stride) -> Tensor:
    """[n, 2]: unit vector, the mean direction of the feet with the swing foot at its target yaw."""
    yaw_rad = torch.where(stride.air, stride.yaw_rad[:, None], feet.yaw_rad)
    ahead = unit(yaw_rad).sum(dim=1)
    return ahead / ahead.norm(dim=1, keepdim=True)


def _bend(tasks: Tasks, figure: Figure, feet: Footing, stride: Stride, reach: Reach) -> None:
    """Standing, the trunk bends as far as the hands need, and rises with what they hold."""
    pitch = _pitch(figure, feet, reach)
    weight = _TRUNK * stride.standing
    for body, share in ((_PELVIS, _PELVIS_SHARE), (_TORSO, 1.0)):
        turn = rotation_error(figure.rotation[:, body], attitude(feet.heading, pitch * share))
        tasks.add(figure.turning_jacobian(body), shortened(turn, _BEND_RAD), weight)
    rise = (_TALL_M - figure.position[:, _PELVIS, 2]).clamp(0.0, _RISE_M)
    up = (reach.pressing | ~reach.active) & stride.standing
    tasks.add(figure.point_jacobian(_PELVIS)[:, 2:], rise[:, None], _HEIGHT * up)


def _pitch(figure: Figure, feet: Footing, reach: Reach) -> Tensor:
    """[n]: next pitch of the trunk, rad, forward."""
    up = figure.rotation[:, _TORSO, :, 2]
    now = torch.atan2((up[:, :2] * feet.heading).sum(dim=1), up[:, 2])
    low = ((_UPRIGHT_M - reach.height_m) * _BEND_RAD_M).clamp(0.0, _BENT_RAD)
    far = (reach.goal - figure.position[:, _SHOULDERS]).norm(dim=2).mean(dim=1) - _EASY_M
    down = torch.maximum(low, now + far.clamp(-_BEND_ON_RAD, _BEND_ON_RAD))
    # the legs lift before the back does
    kept = torch.where(figure.position[:, _PELVIS, 2] < _RISEN_M, low, 0.0)
    back = torch.maximum(kept, now - _UNBEND_RAD)
    pitch = torch.where(reach.pressing, back, down.clamp(0.0, _BENT_MOST_RAD))
    return torch.where(reach.active, pitch, 0.0)


def _hands(tasks: Tasks, figure: Figure, stride: Stride, reach: Reach, pace: Pace) -> None:
    """The hands make their next move, relative to a walking body; the elbows stay outside the
    box."""
    along = torch.where(stride.standing[:, None], 0.0, pace.velocity * SERVO_S)
    along = torch.cat((along, torch.zeros_like(along[:, :1])), dim=1)
    for side, (hand, elbow, sign) in enumerate(zip(HANDS, _ELBOWS, _OUTWARD, strict=True)):
        outward = sign * reach.left
        off = ((figure.position[:, elbow] - reach.faces[:, side]) * outward).sum(dim=1)
        out = (_OUTSIDE_M - off).clamp(0.0, _OUTSIDE_STEP_M)
        row = (figure.point_jacobian(elbow) * outward[:, :, None]).sum(dim=1, keepdim=True)
        tasks.add(row, out[:, None], _ELBOW * reach.active)
        tasks.add(figure.point_jacobian(hand), reach.step[:, side] + along, _HAND * reach.active)


def _pose(tasks: Tasks, figure: Figure, stride: Stride, pace: Pace) -> None:
    """The joints tend to the standing pose; the neck shows the phase cue while walking."""
    here = servos.coordinates(figure.qpos)
    back = (_POSE * (_NOMINAL - here)).clamp(-_POSE_RAD, _POSE_RAD)
    weight = torch.full_like(back, _JOINT)
    weight[:, _ARMS] = _ARM
    weight[:, _KNEES] = torch.where(stride.standing, _KNEE, _JOINT)[:, None].double()
    walks = ~stride.standing[:, None]
    cue, rest = pace.neck - here[:, NECK], (_NOMINAL - here)[:, NECK]
    turn = torch.where(walks, _NECK_WAY * cue, _NECK_BACK * rest)
    back[:, NECK] = turn.clamp(-_NECK_RAD, _NECK_RAD)
    weight[:, NECK] = torch.where(walks, _NECK, weight[:, NECK])
    jacobian = torch.eye(character.NV, dtype=back.dtype)[6:].expand(len(back), -1, -1)
    tasks.add(jacobian, back, weight)


def _effort(
    figure: Figure, feet: Footing, stride: Stride, mass: Mass, pressure: Tensor, push: Tensor
) -> Tensor:
    """[n, 34]: joint torques, N·m, that support the mass and accelerate it by `push` [n, 2], m/s²,
    with the centre of pressure at `pressure` [n, 2], m. In double support the feet share the force
    by the nearest point of the line between them."""
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

"""The gait: swing and stance foot, footholds and the centre of pressure.

The mass falls over the stance foot as an inverted pendulum. The unstable part of that motion, the
divergent component of motion ξ = x + ẋ/ω (Takenaka et al. 2009; Englsberger et al. 2015), moves
away from the centre of pressure u by ξ(t) = u + (ξ(0) − u) exp(ω t). This predicts ξ at
touch-down, and the foot lands at the offset from there that the next step needs (Khadiv et al., "A
robust walking controller based on online step location and duration optimization",
arXiv:1704.01271). The duration of a step is fixed, except that an early contact ends it. In double
support u moves linearly from one foot to the other.
"""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from world import rotations
from world.character import model as character
from world.teachers.scripted.whole_body import GRAVITY_M_S2, Figure, Mass, apply

_BODY = character.BODIES.index
#: Right first: 0 is the right foot, 1 the left foot.
FEET = (_BODY("right_foot"), _BODY("left_foot"))
#: Centre of the sole in the foot's frame, and height of that frame above the sole, m.
_SOLE, ANKLE_M = (0.045, 0.0, -0.05), 0.05
CONTROL_S = 1.0 / character.CONTROL_HZ
#: Rate of the inverted pendulum with its mass 0.88 m high, 1/s.
OMEGA = math.sqrt(GRAVITY_M_S2 / 0.88)
STAND, SHIFT, STEP = 0, 1, 2
#: Control steps of single support, and of double support between two of these.
SWING_STEPS, _BOTH_STEPS = 10, 1
#: A sole this near to the floor has landed, m, after this fraction of the swing.
_DOWN_M, _LATE = 0.006, 0.7
#: The foothold is fixed from this fraction of the swing on: contact disturbs ξ afterwards.
_FIXED = 0.9
#: The first foot lifts when ξ is within this of the other foot, sideways, m.
_OVER_M = 0.04
#: Lateral distance of the feet, m.
_WIDTH_M = 0.22
#: Bounds of a step along and across the stance foot, m: within reach and without crossed legs.
_AHEAD_M, _ASIDE_M = (-0.4, 0.6), (0.1, 0.5)
#: Largest turn of the foot in a step, rad, and the fraction of it by which the foothold turns.
_TURN_RAD, _TURN_SHARE = 0.7, 0.3
#: Gain by which the centre of pressure follows the error of ξ, and the bounds of the sole, ahead
#: and aside, m.
_TRIM, _TRIM_M = 1.2, (0.07, 0.025)
#: The same gain and bound during a weight shift, ahead and back.
_HOLD, _HOLD_M = 3.0, 0.09
#: Height of the swing path, m, and the fraction of it that starts and ends at rest.
_RISE_M, _SOFT = 0.055, 0.2
#: The foot has turned by this fraction of the swing. Errors of its path decay at this rate, 1/s.
#: The path is evaluated this many control steps ahead, horizontally and vertically, against lag.
_TURNED_BY, _TRACK_HZ, _LEAD, _LEAD_UP = 0.8, 11.0, 0.5, 1.0
#: The feet may come to rest within these differences: ahead m, aside m, rad.
_LEVEL_M, _NEAR_M, _ALIKE_RAD = 0.14, 0.4, 0.6
#: A step has failed where both soles are this low, m, this many control steps after its lift-off; a
#: weight shift this many after its begin, with the mass slower than this, m/s.
_UP_BY_STEPS, _SHIFTED_BY_STEPS, _FLAT_M, _STILL_M_S = 5, 20, 0.012, 0.06
#: A foot above the first height is in the air, m, which it reaches this many control steps after
#: lift-off; a foot below the third stands, m. A swing of the other foot is accepted from this many
#: control steps into the expected one.
_FLIES_M, _FLIES_BY, _STANDS_M, _OTHER_BY = 0.02, 2.0, 0.015, 3
#: A foot that is still this high at the end of its swing, m, gets this many control steps more.
_HIGH_M, _WAITS = 0.045, 3
#: The first step goes to the side of a turn, rad, or else of a lateral step, m, beyond these.
_FIRST_TURN_RAD, _FIRST_LEFT_M = 0.1, 0.02

# Growth of an offset of ξ over double and single support, and the factor of the move of u between
# the feet that is subtracted from it.
_GROWTH_BOTH = math.exp(OMEGA * _BOTH_STEPS * CONTROL_S)
_GROWTH_SWING = math.exp(OMEGA * SWING_STEPS * CONTROL_S)
_HANDED_OVER = (_GROWTH_BOTH - 1.0) / (OMEGA * _BOTH_STEPS * CONTROL_S)


@dataclass(frozen=True)
class Footing:
    """Poses of the feet."""

    ankles: Tensor
    """[n, 2, 3]: of the feet's frames, m."""
    soles: Tensor
    """[n, 2, 3]: of the centres of the soles, m."""
    yaw_rad: Tensor
    """[n, 2]: of the feet."""
    heading: Tensor
    """[n, 2]: horizontal unit vector, the mean direction of the feet."""

    @staticmethod
    def of(figure: Figure) -> "Footing":
        """The footing of a figure."""
        ankles, rotation = figure.position[:, FEET], figure.rotation[:, FEET]
        soles = ankles + apply(rotation, ankles.new_tensor(_SOLE))
        yaw_rad = torch.atan2(rotation[..., 1, 0], rotation[..., 0, 0])
        heading = unit(yaw_rad).sum(dim=1)
        return Footing(ankles, soles, yaw_rad, heading / heading.norm(dim=1, keepdim=True))

    def middle(self, ahead_m: float) -> Tensor:
        """[n, 2]: the point this far ahead of the centre between the soles, m."""
        return self.soles[:, :, :2].mean(dim=1) + ahead_m * self.heading


@dataclass(frozen=True)
class Stride:
    """What the gait requests of the body in one control step."""

    standing: Tensor
    """[n] bool: both feet rest; elsewhere the gait decides pressure and mass."""
    air: Tensor
    """[n, 2] bool: the foot is in the air."""
    pressure: Tensor
    """[n, 2]: centre of pressure, m; unused where the character stands."""
    velocity: Tensor
    """[n, 3]: of the swing foot, m/s."""
    yaw_rad: Tensor
    """[n]: target yaw of the swing foot."""


@dataclass(frozen=True)
class _Stance:
    """The stance foot and the frame of a step."""

    foot: Tensor
    """[n, 2]: centre of its sole, m."""
    other: Tensor
    """[n, 2]: centre of the other sole, m."""
    yaw_rad: Tensor
    """[n]."""
    heading: Tensor
    """[n, 2]."""
    side: Tensor
    """[n]: 1 where the other foot is the left one, −1 where it is the right one."""

    def local(self, point: Tensor) -> Tensor:
        """[n, 2]: a point on the floor in the foot's frame, ahead and to the left, m."""
        return rotations.turn_back(self.heading, point - self.foot)


class Gait:
    """The steps of n characters."""

    def __init__(self, n: int) -> None:
        self.mode = torch.zeros(n, dtype=torch.int64)
        """[n]: STAND, SHIFT (of the weight to the first stance foot) or STEP."""
        self.swing = torch.zeros(n, dtype=torch.int64)
        """[n]: the swing foot, or the next one."""
        self.time = torch.zeros(n, dtype=torch.float64)
        """[n]: control steps since its lift-off; below 0 in double support."""
        self.stalled = torch.zeros(n, dtype=torch.bool)
        """[n]: a step began but was not made; happens where another controller drives."""
        self._flew = torch.zeros(n, dtype=torch.bool)
        self._lifted = torch.zeros(n, 3, dtype=torch.float64)
        self._lifted_yaw = torch.zeros(n, dtype=torch.float64)
        self._goal = torch.zeros(n, 2, dtype=torch.float64)

    def reset(self, ids: Tensor) -> None:
        """Set the characters `ids` to standing."""
        for state in self.state_dict().values():
            state[ids] = 0

    def state_dict(self) -> dict[str, Tensor]:
        """The state that is kept from step to step, by name; the tensors themselves."""
        return {
            name.removeprefix("_"): value
            for name, value in vars(self).items()
            if isinstance(value, Tensor)
        }

    @property
    def standing(self) -> Tensor:
        """[n] bool: both feet rest."""
        return self.mode == STAND

    @property
    def stepping(self) -> Tensor:
        """[n] bool: a step is under way."""
        return self.mode == STEP

    @property
    def landed(self) -> Tensor:
        """[n] bool: a step has just ended or none has begun; the next step is decided now."""
        return (self.mode != STEP) | (self.time == -_BOTH_STEPS)

    def ending(self, feet: Footing) -> Footing:
        """The footing after the step under way if it is the last one: the swing foot beside the
        stance foot. The next step is planned from there."""
        stance = self._stance(feet)
        left = torch.stack((-stance.heading[:, 1], stance.heading[:, 0]), dim=1)
        beside = stance.foot + (stance.side * _WIDTH_M)[:, None] * left
        beside = torch.cat((beside, torch.zeros_like(beside[:, :1])), dim=1)
        swings = (self.mode == STEP)[:, None] & (torch.arange(2) == self.swing[:, None])
        soles = torch.where(swings[..., None], beside[:, None], feet.soles)
        yaw_rad = torch.where(swings, stance.yaw_rad[:, None], feet.yaw_rad)
        heading = unit(yaw_rad).sum(dim=1)
        heading = heading / heading.norm(dim=1, keepdim=True)
        return Footing(feet.ankles, soles, yaw_rad, heading)

    def advance(self, feet: Footing, mass: Mass, command: Tensor, stop: Tensor) -> Stride:
        """Advance by one control step.

        command [n, 3]: step ahead and to the left, m, and its turn, rad, in the frame of the feet;
        stop [n] bool: come to rest with the feet side by side.
        """
        dcm = mass.position + mass.velocity / OMEGA
        self._observe(feet, mass)
        self._start(command, stop)
        self._change_feet(feet, dcm, stop)
        stance = self._stance(feet)
        pressure = self._pressure(stance, dcm, command)
        turn = command[:, 2].clamp(-_TURN_RAD, _TURN_RAD)
        landing = self._landing(stance, dcm, pressure, command, turn)
        kept = self.time > _FIXED * SWING_STEPS
        self._goal = torch.where(kept[:, None], self._goal, landing)
        velocity, yaw_rad = self._swing(feet, stance.yaw_rad + turn)
        flies = (self.mode == STEP) & (self.time >= 0)
        air = torch.stack((flies & (self.swing == 0), flies & (self.swing == 1)), dim=1)
        shifts = (self.mode == SHIFT)[:, None]
        pressure = torch.where(shifts, _shifting(stance, dcm), pressure)
        return Stride(self.mode == STAND, air, pressure, velocity, yaw_rad)

    def _stance(self, feet: Footing) -> _Stance:
        rows = torch.arange(len(self.swing))
        standing = 1 - self.swing
        yaw_rad = feet.yaw_rad[rows, standing]
        side = torch.where(self.swing == 1, 1.0, -1.0).double()
        foot, other = feet.soles[rows, standing, :2], feet.soles[rows, self.swing, :2]
        return _Stance(foot, other, yaw_rad, unit(yaw_rad), side)

    def _observe(self, feet: Footing, mass: Mass) -> None:
        """Follow the step that is observed, which another controller may make; return to standing
        where the expected step is not made."""
        height = feet.soles[:, :, 2]
        low, foot = height.min(dim=1).values, height.argmax(dim=1)
        flies = (height.max(dim=1).values > _FLIES_M) & (low < _STANDS_M)
        steps, same = self.mode == STEP, self.swing == foot
        # a swing of the other foot, or of the expected foot before or after its time
        other = flies & ~(steps & (same | (self.time < _OTHER_BY)))
        late = flies & steps & same & ~self._flew & (self.time > _FLIES_BY + 1.0)
        self.swing = torch.where(other, foot, self.swing)
        self.time = torch.where(other | late, _FLIES_BY, self.time)
        self.mode = torch.where(other, STEP, self.mode)
        self._mark_lift_off(other, feet)
        self._flew = torch.where(flies & (self.swing == foot), self.mode == STEP, self._flew)
        down = (height < _FLAT_M).all(dim=1)
        still = mass.velocity.norm(dim=1) < _STILL_M_S
        stays = (self.mode == STEP) & (self.time > _UP_BY_STEPS) & ~self._flew
        stays = stays | ((self.mode == SHIFT) & (self.time > _SHIFTED_BY_STEPS) & still)
        rests = stays & down
        self.mode = torch.where(rests, STAND, self.mode)
        self.stalled = rests | (self.stalled & (self.mode != STEP))

    def _start(self, command: Tensor, stop: Tensor) -> None:
        """Begin a weight shift where standing ends; the first foot is that of the side of the turn
        or step."""
        goes = (self.mode == STAND) & ~stop
        turns = command[:, 2].abs() > _FIRST_TURN_RAD
        left = torch.where(turns, command[:, 2] > 0.0, command[:, 1] > _FIRST_LEFT_M)
        self.swing = torch.where(goes, left.long(), self.swing)
        self.mode = torch.where(goes, SHIFT, self.mode)
        self.time = torch.where(goes, 0.0, self.time)

    def _change_feet(self, feet: Footing, dcm: Tensor, stop: Tensor) -> None:
        """Lift the unloaded foot, end the swing whose time is over, and stand where both feet rest
        side by side and `stop` is set."""
        stance = self._stance(feet)
        over = stance.local(dcm)[:, 1] * stance.side < _OVER_M
        lifts = (self.mode == SHIFT) & over
        self.time = torch.where(self.mode != STAND, self.time + 1.0, self.time)
        rows = torch.arange(len(self.swing))
        height = feet.soles[rows, self.swing, 2]
        due = torch.where(self._flew, float(_UP_BY_STEPS), _LATE * SWING_STEPS)
        down = (height < _DOWN_M) & (self.time > due)
        over = self.time >= SWING_STEPS + torch.where(height > _HIGH_M, _WAITS, 0)
        ends = (self.mode == STEP) & (over | down)
        self.swing = torch.where(ends, 1 - self.swing, self.swing)
        self.time = torch.where(ends, -float(_BOTH_STEPS), self.time)
        self.mode = torch.where(lifts, STEP, self.mode)
        self.time = torch.where(lifts, 0.0, self.time)
        self._flew &= ~(ends | lifts)
        self._mark_lift_off((self.mode == STEP) & (self.time <= 0), feet)
        stance = self._stance(feet)
        apart = stance.local(stance.other).abs()
        alike = (feet.yaw_rad[:, 0] - feet.yaw_rad[:, 1]).abs() < _ALIKE_RAD
        rests = stop & ends & (apart[:, 0] < _LEVEL_M) & (apart[:, 1] < _NEAR_M) & alike
        self.mode = torch.where(rests, STAND, self.mode)

    def _mark_lift_off(self, now: Tensor, feet: Footing) -> None:
        """Store the pose of the swing foot as its lift-off pose where `now` [n] bool."""
        rows = torch.arange(len(self.swing))
        ankle, yaw = feet.ankles[rows, self.swing], feet.yaw_rad[rows, self.swing]
        self._lifted = torch.where(now[:, None], ankle, self._lifted)
        self._lifted_yaw = torch.where(now, yaw, self._lifted_yaw)

    def _pressure(self, stance: _Stance, dcm: Tensor, command: Tensor) -> Tensor:
        """[n, 2]: centre of pressure, m: below the stance foot, corrected by the error of ξ;
        between the feet in double support."""
        share = ((self.time + _BOTH_STEPS) / _BOTH_STEPS).clamp(0.0, 1.0)[:, None]
        between = stance.other + (stance.foot - stance.other) * share
        since = self.time.clamp_min(0.0) * CONTROL_S
        due = _offset(command, stance.side) * torch.exp(OMEGA * since)[:, None]
        error = _TRIM * (stance.local(dcm) - due)
        most = error.new_tensor(_TRIM_M)
        trimmed = rotations.turn(stance.heading, torch.maximum(torch.minimum(error, most), -most))
        return torch.where((self.time < 0)[:, None], between, stance.foot + trimmed)

    def _landing(
        self, stance: _Stance, dcm: Tensor, pressure: Tensor, command: Tensor, turn: Tensor
    ) -> Tensor:
        """[n, 2]: foothold of the sole's centre, m, at which ξ has the offset that the next step
        starts with."""
        left = (SWING_STEPS - self.time.clamp_min(0.0)).clamp_min(0.0) * CONTROL_S
        there = pressure + (dcm - pressure) * torch.exp(OMEGA * left)[:, None]
        offset = _offset(command, -stance.side)
        offset = rotations.turn(unit(_TURN_SHARE * turn), offset)
        step = (_GROWTH_BOTH * stance.local(there) - offset) / _HANDED_OVER
        aside = (step[:, 1] * stance.side).clamp(*_ASIDE_M) * stance.side
        step = torch.stack((step[:, 0].clamp(*_AHEAD_M), aside), dim=1)
        return stance.foot + rotations.turn(stance.heading, step)

    def _swing(self, feet: Footing, yaw_rad: Tensor) -> tuple[Tensor, Tensor]:
        """Velocity [n, 3] m/s and yaw [n] rad of the swing foot, which lands with yaw_rad [n]."""
        back = rotations.turn(unit(yaw_rad), yaw_rad.new_tensor(_SOLE[:2]))
        goal = self._goal - back
        time = self.time.clamp_min(0.0)[:, None]
        leads = time.new_tensor((_LEAD, _LEAD_UP))
        ahead = [((time + leads + k) / SWING_STEPS).clamp(0.0, 1.0) for k in (0.0, 1.0)]
        then = ((time[:, 0] + 1.0) / SWING_STEPS).clamp(0.0, 1.0)
        ankle = feet.ankles[torch.arange(len(self.swing)), self.swing]
        place, goes = self._path(goal, ahead[0]), self._path(goal, ahead[1])
        velocity = (goes - place) / CONTROL_S + _TRACK_HZ * (place - ankle)
        turned = _eased((then / _TURNED_BY).clamp_max(1.0))
        return velocity, self._lifted_yaw + wrapped(yaw_rad - self._lifted_yaw) * turned

    def _path(self, goal: Tensor, share: Tensor) -> Tensor:
        """[n, 3]: position of the ankle after these fractions [n, 2] of the swing, horizontal and
        vertical, towards a goal [n, 2], m."""
        level = self._lifted[:, :2] + (goal - self._lifted[:, :2]) * _eased(share[:, :1])
        arc = torch.sin(math.pi * share[:, 1])
        height = ANKLE_M + _RISE_M * (_SOFT * arc.square() + (1.0 - _SOFT) * arc)
        return torch.cat((level, height[:, None]), dim=1)


def _shifting(stance: _Stance, dcm: Tensor) -> Tensor:
    """[n, 2]: centre of pressure during a weight shift, m. It lies below the foot that will lift,
    which pushes the mass away from that foot. Ahead and back it holds ξ over the sole: a slow shift
    would otherwise end in a fall."""
    seen = rotations.turn_back(stance.heading, dcm - stance.other)
    ahead = (_HOLD * seen[:, 0]).clamp(-_HOLD_M, _HOLD_M)
    return stance.other + ahead[:, None] * stance.heading


def _offset(command: Tensor, side: Tensor) -> Tensor:
    """[n, 2]: offset of ξ from the stance foot at lift-off, ahead and to the left, m, that repeats
    itself where every step follows the command; side [n]: of the other foot."""
    growth = _GROWTH_BOTH * _GROWTH_SWING
    on = _HANDED_OVER * command[:, :2] / (growth - 1.0)
    aside = side * _HANDED_OVER * _WIDTH_M / (growth + 1.0)
    return torch.stack((on[:, 0], aside + on[:, 1]), dim=1)


def unit(angle_rad: Tensor) -> Tensor:
    """Cosine and sine [..., 2] of angles [...]."""
    return torch.stack((angle_rad.cos(), angle_rad.sin()), dim=-1)


def wrapped(angle_rad: Tensor) -> Tensor:
    """The same angles in [−π, π)."""
    return (angle_rad + math.pi) % (2.0 * math.pi) - math.pi


def _eased(share: Tensor) -> Tensor:
    """Fractions from 0 to 1, smoothed to begin and end at rest."""
    return share * share * (3.0 - 2.0 * share)

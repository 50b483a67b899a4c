"""Stepping: which foot is in the air, where it lands and where the floor should push meanwhile.

The mass falls over its foot as an inverted pendulum does. The unstable half of that motion, its
divergent component ξ = x + ẋ/ω (Takenaka et al. 2009; Englsberger et al. 2015), grows away from the
centre of pressure u by ξ(t) = u + (ξ(0) − u) exp(ω t), so that at each moment it is known where it
will be when the foot comes down: the foot lands so far from there as the next step needs (Khadiv et
al., "A robust walking controller based on online step location and duration optimization",
arXiv:1704.01271; the duration is fixed here, but that a foot that is down early has landed). While
both feet stand, u moves evenly from one to the other.
"""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from world import rotations
from world.character import model as character
from world.teachers.whole_body import GRAVITY_M_S2, Figure, Mass, apply

_BODY = character.BODIES.index
#: Right first, as everywhere here: 0 is the right one, 1 the left one.
FEET = (_BODY("right_foot"), _BODY("left_foot"))
#: The middle of the sole in the foot's frame, and the height of that frame above it, m.
_SOLE, ANKLE_M = (0.045, 0.0, -0.05), 0.05
CONTROL_S = 1.0 / character.CONTROL_HZ
#: Rate at which a mass 0.88 m high falls over, 1/s.
OMEGA = math.sqrt(GRAVITY_M_S2 / 0.88)
STAND, SHIFT, STEP = 0, 1, 2
#: Control steps with one foot in the air, and with both down between two of these.
SWING_STEPS, _BOTH_STEPS = 10, 1
#: A sole this near to the floor has landed, m, once so much of the swing is over.
_DOWN_M, _LATE = 0.006, 0.7
#: From here on the landing place is kept: what moves now does so because the foot comes down.
_FIXED = 0.9
#: From a stand the first foot lifts when ξ is within this of the other one, sideways, m.
_OVER_M = 0.04
#: Between the feet, sideways, m.
_WIDTH_M = 0.22
#: Bounds of a step along and across the stance foot, m: as far as legs reach without crossing.
_AHEAD_M, _ASIDE_M = (-0.4, 0.6), (0.1, 0.5)
#: The foot turns by at most this a step, rad, and the step with it by this share.
_TURN_RAD, _TURN_SHARE = 0.7, 0.3
#: The pressure below the standing foot gives way by this much of where ξ is amiss, but no further
#: than the sole reaches, ahead and aside, m.
_TRIM, _TRIM_M = 1.2, (0.07, 0.025)
#: While the weight shifts, likewise with ξ ahead of or behind the middle of the sole.
_HOLD, _HOLD_M = 3.0, 0.09
#: A foot rises by so much; a share of that path starts and ends at rest.
_RISE_M, _SOFT = 0.055, 0.2
#: By this share of the swing it is turned; it is brought back to its path at this rate, 1/s, and
#: led along it and up and down by so many control steps more, for it lags.
_TURNED_BY, _TRACK_HZ, _LEAD, _LEAD_UP = 0.8, 11.0, 0.5, 1.0
#: Level, near and turned like this the feet may rest side by side: ahead m, aside m, rad.
_LEVEL_M, _NEAR_M, _ALIKE_RAD = 0.14, 0.4, 0.6
#: A step is not made where so many control steps into it both soles are this low, m; nor is a shift
#: of the weight that long after it began, when the mass goes at no more than that, m/s.
_UP_BY_STEPS, _SHIFTED_BY_STEPS, _FLAT_M, _STILL_M_S = 5, 20, 0.012, 0.06
#: A foot this high is in the air, m, so many control steps after it lifted, give or take one; one
#: below that, m, stands. Another foot's step counts from so many into the one that was due.
_FLIES_M, _FLIES_BY, _STANDS_M, _OTHER_BY = 0.02, 2.0, 0.015, 3
#: A foot that is still this high when its time is over, m, is waited for by so many control steps.
_HIGH_M, _WAITS = 0.045, 3
#: A turn (rad), else a way to the left (m) beyond these is begun with the foot of that side.
_FIRST_TURN_RAD, _FIRST_LEFT_M = 0.1, 0.02

# What becomes of an offset of ξ while both feet stand, and while one does; and how many times the
# move of u between the feet is taken off it.
_GROWTH_BOTH = math.exp(OMEGA * _BOTH_STEPS * CONTROL_S)
_GROWTH_SWING = math.exp(OMEGA * SWING_STEPS * CONTROL_S)
_HANDED_OVER = (_GROWTH_BOTH - 1.0) / (OMEGA * _BOTH_STEPS * CONTROL_S)


@dataclass(frozen=True)
class Footing:
    """Where the feet are."""

    ankles: Tensor
    """[n, 2, 3]: of the feet's frames, m."""
    soles: Tensor
    """[n, 2, 3]: of the middles of the soles, m."""
    yaw_rad: Tensor
    """[n, 2]: of the feet."""
    heading: Tensor
    """[n, 2]: horizontal unit vector between the ways that they point."""

    @staticmethod
    def of(figure: Figure) -> "Footing":
        ankles, rotation = figure.position[:, FEET], figure.rotation[:, FEET]
        soles = ankles + apply(rotation, ankles.new_tensor(_SOLE))
        yaw_rad = torch.atan2(rotation[..., 1, 0], rotation[..., 0, 0])
        heading = unit(yaw_rad).sum(dim=1)
        return Footing(ankles, soles, yaw_rad, heading / heading.norm(dim=1, keepdim=True))

    def middle(self, ahead_m: float) -> Tensor:
        """[n, 2]: so far ahead of the middle between the soles, m."""
        return self.soles[:, :, :2].mean(dim=1) + ahead_m * self.heading


@dataclass(frozen=True)
class Stride:
    """What stepping asks of the body at this moment."""

    stands: Tensor
    """[n] bool: both feet rest; of the others' pressure and mass the gait has the say."""
    air: Tensor
    """[n, 2] bool: the foot is in the air."""
    pressure: Tensor
    """[n, 2]: where the floor should push, m; of those who do not stand."""
    velocity: Tensor
    """[n, 3]: of the foot in the air, m/s."""
    yaw_rad: Tensor
    """[n]: where it should point."""


@dataclass(frozen=True)
class _Stance:
    """Those who step, seen from the foot that stands."""

    foot: Tensor
    """[n, 2]: the middle of its sole, m."""
    other: Tensor
    """[n, 2]: of the other one's."""
    yaw_rad: Tensor
    """[n]."""
    heading: Tensor
    """[n, 2]."""
    side: Tensor
    """[n]: 1 where the other foot is the left one, −1 where it is the right one."""

    def seen(self, point: Tensor) -> Tensor:
        """[n, 2]: a point on the floor, ahead of and to the left of the foot, m."""
        return rotations.turn_back(self.heading, point - self.foot)


class Gait:
    """The steps of n characters."""

    def __init__(self, n: int) -> None:
        self.mode = torch.zeros(n, dtype=torch.int64)
        """[n]: STAND, SHIFT (the weight goes to the first stance foot) or STEP."""
        self.swing = torch.zeros(n, dtype=torch.int64)
        """[n]: the foot that is in the air, or is next."""
        self.time = torch.zeros(n, dtype=torch.float64)
        """[n]: control steps since it lifted; below 0 both feet are still down."""
        self.balks = torch.zeros(n, dtype=torch.bool)
        """[n]: stands since a step that was begun was not made; another one has the servos."""
        self._flew = torch.zeros(n, dtype=torch.bool)
        self._lifted = torch.zeros(n, 3, dtype=torch.float64)
        self._lifted_yaw = torch.zeros(n, dtype=torch.float64)
        self._goal = torch.zeros(n, 2, dtype=torch.float64)

    def reset(self, ids: Tensor) -> None:
        """Let the characters `ids` stand."""
        for state in self.memory().values():
            state[ids] = 0

    def memory(self) -> dict[str, Tensor]:
        """All that is kept from step to step, by name."""
        return {name: value for name, value in vars(self).items() if isinstance(value, Tensor)}

    @property
    def stands(self) -> Tensor:
        """[n] bool: both feet rest."""
        return self.mode == STAND

    @property
    def walks(self) -> Tensor:
        """[n] bool: a step was begun."""
        return self.mode == STEP

    @property
    def landed(self) -> Tensor:
        """[n] bool: a step ended just now, or none has begun: time to want another one."""
        return (self.mode != STEP) | (self.time == -_BOTH_STEPS)

    def ending(self, feet: Footing) -> Footing:
        """The feet as they will be if the step that is made is the last one, for it ends beside the
        foot that stands: what the next step is judged from. Who stands has them so already."""
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

    def advance(self, feet: Footing, mass: Mass, wish: Tensor, stop: Tensor) -> Stride:
        """One control step on.

        wish [n, 3]: how far a step goes ahead and to the left, m, and turns, rad, seen from the
        feet; stop [n] bool: come to rest with the feet side by side.
        """
        falling = mass.position + mass.velocity / OMEGA
        self._notice(feet, mass)
        self._set_off(wish, stop)
        self._go_on(feet, falling, stop)
        stance = self._stance(feet)
        pressure = self._pressure(stance, falling, wish)
        turn = wish[:, 2].clamp(-_TURN_RAD, _TURN_RAD)
        landing = self._landing(stance, falling, pressure, wish, turn)
        kept = self.time > _FIXED * SWING_STEPS
        self._goal = torch.where(kept[:, None], self._goal, landing)
        velocity, yaw_rad = self._swing(feet, stance.yaw_rad + turn)
        flies = (self.mode == STEP) & (self.time >= 0)
        air = torch.stack((flies & (self.swing == 0), flies & (self.swing == 1)), dim=1)
        shifts = (self.mode == SHIFT)[:, None]
        pressure = torch.where(shifts, _shifting(stance, falling), pressure)
        return Stride(self.mode == STAND, air, pressure, velocity, yaw_rad)

    def _stance(self, feet: Footing) -> _Stance:
        rows = torch.arange(len(self.swing))
        standing = 1 - self.swing
        yaw_rad = feet.yaw_rad[rows, standing]
        side = torch.where(self.swing == 1, 1.0, -1.0).double()
        foot, other = feet.soles[rows, standing, :2], feet.soles[rows, self.swing, :2]
        return _Stance(foot, other, yaw_rad, unit(yaw_rad), side)

    def _notice(self, feet: Footing, mass: Mass) -> None:
        """Another one may have the servos: go along with the step that is under way, and let who
        does not make the one that was begun stand."""
        height = feet.soles[:, :, 2]
        low, foot = height.min(dim=1).values, height.argmax(dim=1)
        flies = (height.max(dim=1).values > _FLIES_M) & (low < _STANDS_M)
        steps, same = self.mode == STEP, self.swing == foot
        # one that is not the next, or not yet, or later than was thought
        other = flies & ~(steps & (same | (self.time < _OTHER_BY)))
        late = flies & steps & same & ~self._flew & (self.time > _FLIES_BY + 1.0)
        self.swing = torch.where(other, foot, self.swing)
        self.time = torch.where(other | late, _FLIES_BY, self.time)
        self.mode = torch.where(other, STEP, self.mode)
        self._leave(other, feet)
        self._flew = torch.where(flies & (self.swing == foot), self.mode == STEP, self._flew)
        down = (height < _FLAT_M).all(dim=1)
        still = mass.velocity.norm(dim=1) < _STILL_M_S
        stays = (self.mode == STEP) & (self.time > _UP_BY_STEPS) & ~self._flew
        stays = stays | ((self.mode == SHIFT) & (self.time > _SHIFTED_BY_STEPS) & still)
        rests = stays & down
        self.mode = torch.where(rests, STAND, self.mode)
        self.balks = rests | (self.balks & (self.mode != STEP))

    def _set_off(self, wish: Tensor, stop: Tensor) -> None:
        """Who stands and should not begins with the foot of the side that he turns or goes to."""
        goes = (self.mode == STAND) & ~stop
        turns = wish[:, 2].abs() > _FIRST_TURN_RAD
        left = torch.where(turns, wish[:, 2] > 0.0, wish[:, 1] > _FIRST_LEFT_M)
        self.swing = torch.where(goes, left.long(), self.swing)
        self.mode = torch.where(goes, SHIFT, self.mode)
        self.time = torch.where(goes, 0.0, self.time)

    def _go_on(self, feet: Footing, falling: Tensor, stop: Tensor) -> None:
        """Lift the foot from which the weight has gone, set down the one whose time is over, and
        stand where both rest side by side and should."""
        stance = self._stance(feet)
        over = stance.seen(falling)[:, 1] * stance.side < _OVER_M
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
        self._leave((self.mode == STEP) & (self.time <= 0), feet)
        stance = self._stance(feet)
        apart = stance.seen(stance.other).abs()
        alike = (feet.yaw_rad[:, 0] - feet.yaw_rad[:, 1]).abs() < _ALIKE_RAD
        rests = stop & ends & (apart[:, 0] < _LEVEL_M) & (apart[:, 1] < _NEAR_M) & alike
        self.mode = torch.where(rests, STAND, self.mode)

    def _leave(self, now: Tensor, feet: Footing) -> None:
        """Take where the foot that swings is for where it left the floor, where that is `now` [n]
        bool."""
        rows = torch.arange(len(self.swing))
        ankle, yaw = feet.ankles[rows, self.swing], feet.yaw_rad[rows, self.swing]
        self._lifted = torch.where(now[:, None], ankle, self._lifted)
        self._lifted_yaw = torch.where(now, yaw, self._lifted_yaw)

    def _pressure(self, stance: _Stance, falling: Tensor, wish: Tensor) -> Tensor:
        """[n, 2]: where the floor should push, m: below the standing foot, trimmed against what is
        amiss with ξ; between the feet while both are down."""
        share = ((self.time + _BOTH_STEPS) / _BOTH_STEPS).clamp(0.0, 1.0)[:, None]
        between = stance.other + (stance.foot - stance.other) * share
        since = self.time.clamp_min(0.0) * CONTROL_S
        due = _offset(wish, stance.side) * torch.exp(OMEGA * since)[:, None]
        amiss = _TRIM * (stance.seen(falling) - due)
        most = amiss.new_tensor(_TRIM_M)
        trimmed = rotations.turn(stance.heading, torch.maximum(torch.minimum(amiss, most), -most))
        return torch.where((self.time < 0)[:, None], between, stance.foot + trimmed)

    def _landing(
        self, stance: _Stance, falling: Tensor, pressure: Tensor, wish: Tensor, turn: Tensor
    ) -> Tensor:
        """[n, 2]: where the middle of the sole should come down, m: so that ξ is there with the
        offset that the next step begins with."""
        left = (SWING_STEPS - self.time.clamp_min(0.0)).clamp_min(0.0) * CONTROL_S
        there = pressure + (falling - pressure) * torch.exp(OMEGA * left)[:, None]
        offset = _offset(wish, -stance.side)
        offset = rotations.turn(unit(_TURN_SHARE * turn), offset)
        step = (_GROWTH_BOTH * stance.seen(there) - offset) / _HANDED_OVER
        aside = (step[:, 1] * stance.side).clamp(*_ASIDE_M) * stance.side
        step = torch.stack((step[:, 0].clamp(*_AHEAD_M), aside), dim=1)
        return stance.foot + rotations.turn(stance.heading, step)

    def _swing(self, feet: Footing, yaw_rad: Tensor) -> tuple[Tensor, Tensor]:
        """Velocity [n, 3] m/s and yaw [n] rad of the foot in the air, that should land with this
        yaw [n]."""
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
        """[n, 3]: where the ankle is after these shares [n, 2] of the swing, level and upwards, to
        a goal [n, 2], m."""
        level = self._lifted[:, :2] + (goal - self._lifted[:, :2]) * _eased(share[:, :1])
        arc = torch.sin(math.pi * share[:, 1])
        height = ANKLE_M + _RISE_M * (_SOFT * arc.square() + (1.0 - _SOFT) * arc)
        return torch.cat((level, height[:, None]), dim=1)


def _shifting(stance: _Stance, falling: Tensor) -> Tensor:
    """[n, 2]: where the floor should push while the weight goes to the stance foot, m: below the
    foot that will lift, from which the mass is so pushed away, but with ξ held over its middle
    ahead and back: a shift that takes longer than it should would end in a fall on one's back."""
    seen = rotations.turn_back(stance.heading, falling - stance.other)
    ahead = (_HOLD * seen[:, 0]).clamp(-_HOLD_M, _HOLD_M)
    return stance.other + ahead[:, None] * stance.heading


def _offset(wish: Tensor, side: Tensor) -> Tensor:
    """[n, 2]: from the standing foot to ξ, ahead and to the left, m, as its swing begins, where
    every step goes as wished and the other foot is at this side [n]: what repeats itself under the
    growth over a step."""
    growth = _GROWTH_BOTH * _GROWTH_SWING
    on = _HANDED_OVER * wish[:, :2] / (growth - 1.0)
    aside = side * _HANDED_OVER * _WIDTH_M / (growth + 1.0)
    return torch.stack((on[:, 0], aside + on[:, 1]), dim=1)


def unit(angle_rad: Tensor) -> Tensor:
    """Cosine and sine [..., 2] of angles [...]."""
    return torch.stack((angle_rad.cos(), angle_rad.sin()), dim=-1)


def wrapped(angle_rad: Tensor) -> Tensor:
    """The same angles in [−π, π)."""
    return (angle_rad + math.pi) % (2.0 * math.pi) - math.pi


def _eased(share: Tensor) -> Tensor:
    """Shares from 0 to 1 that begin and end at rest."""
    return share * share * (3.0 - 2.0 * share)

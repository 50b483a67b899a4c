"""Plans footsteps along a guide, the path of the body in time.

Cadence follows speed by the constant walk ratio of healthy adults, step length / step rate
(Sekiya et al. 1996: 0.0065 m per step/min; here 0.0052, chosen so that the pelvis dips less),
and double support takes about 12 % of a stride twice at comfortable speed, more when slow (Perry
1992).
"""

from dataclasses import dataclass

import numpy as np

from world.motions.synthetic.rotations import Array
from world.motions.synthetic.skeleton import SIDES

RATE_HZ = 120
"""Frame rate of the synthesis; clips have every fourth frame."""

WALK_RATIO_M_S = 0.31
"""Step length over step frequency, m per Hz (0.0052 m per step/min)."""

ANKLE_BEHIND_M = 0.03
"""Distance of a standing ankle behind the guide: the weight is over the mid-foot."""


APART_M = 0.105
"""Least distance between the lines of two feet side by side."""


TOE_IN_RAD, TOE_APART_RAD = 0.30, 1.0
"""Greatest turn of one foot towards, and away from, the other: the hips' range."""


@dataclass(frozen=True)
class Guide:
    """The planned path of the body in time, which may go sideways and backwards."""

    position_m: Array
    """World x, y at RATE_HZ, [T, 2]."""
    yaw_rad: Array
    """Heading, continuous, [T]."""

    def at(self, time_s: float) -> tuple[Array, float]:
        """Position [2] m and yaw at a time, constant beyond both ends."""
        x = np.clip(time_s * RATE_HZ, 0, len(self.yaw_rad) - 1)
        low = int(x)
        high = min(low + 1, len(self.yaw_rad) - 1)
        weight = x - low
        position = (1 - weight) * self.position_m[low] + weight * self.position_m[high]
        return position, float((1 - weight) * self.yaw_rad[low] + weight * self.yaw_rad[high])


@dataclass(frozen=True)
class Stance:
    """One stance of one foot."""

    side: int
    """0 right, 1 left."""
    ankle_m: Array
    """Horizontal position of the ankle while the sole is flat, [2]."""
    yaw_rad: float
    land_s: float
    """Time of landing; −∞: from the start."""
    lift_s: float
    """Time of lift-off; ∞: none."""


@dataclass(frozen=True)
class Habits:
    """Parameters of a walker's foot placement."""

    width_m: float = 0.065
    """Half the step width while walking (Winter 2009: 8-13 cm between the heels)."""
    standing_width_m: float = 0.085
    toe_out_rad: float = 0.10
    first_side: int = 0
    """The foot of the first step; in a turn it is the inner one."""


def foothold(
    guide: Guide, time_s: float, side: int, speed_m_s: float, habits: Habits
) -> tuple[Array, float]:
    """The foothold of a foot for the guide at a time: ankle [2] m and yaw."""
    position, yaw = guide.at(time_s)
    calm = 1 - min(speed_m_s / 0.6, 1.0)
    width = habits.width_m + calm * (habits.standing_width_m - habits.width_m)
    out = SIDES[side] * width
    c, s = np.cos(yaw), np.sin(yaw)
    ankle = position + np.array([-ANKLE_BEHIND_M * c - out * s, -ANKLE_BEHIND_M * s + out * c])
    return ankle, yaw + SIDES[side] * habits.toe_out_rad


def clear_of(
    ankle_m: Array, yaw_rad: float, side: int, other_m: Array, other_yaw_rad: float
) -> tuple[float, Array]:
    """Outward shift (m, at least 0) by which a foot clears the other one, and its direction.

    The soles, 9 cm wide, are kept apart where they are side by side.
    """
    yaw = 0.5 * (yaw_rad + other_yaw_rad)
    outward = SIDES[side] * np.array([-np.sin(yaw), np.cos(yaw)])
    apart = ankle_m - other_m
    beside = np.clip((0.28 - abs(apart @ [np.cos(yaw), np.sin(yaw)])) / 0.08, 0.0, 1.0)
    toe_out = SIDES[side] * (yaw_rad - other_yaw_rad)
    skew = 0.045 * np.sin(max(toe_out, 0.0)) + 0.12 * np.sin(max(-toe_out, 0.0))
    return float(max(APART_M + skew - apart @ outward, 0.0) * beside), outward


def step_timing(guide: Guide, time_s: float) -> tuple[float, float, float]:
    """Step period (s), fraction of it in double support, and speed (m/s) from a time on."""
    (before, yaw_before), (after, yaw_after) = guide.at(time_s), guide.at(time_s + 0.7)
    speed = float(np.linalg.norm(after - before)) / 0.7
    turning = abs(yaw_after - yaw_before) / 0.7
    slowest = 1.35 + min(0.25 * turning, 0.4)
    rate = np.clip(np.sqrt(speed / WALK_RATIO_M_S), slowest, 2.4)
    return 1 / rate, float(np.clip(0.24 + 0.15 * (1.3 - speed), 0.22, 0.36)), speed


def plan(guide: Guide, habits: Habits) -> list[Stance]:
    """The footsteps along a guide; they end with both feet beneath its last position."""
    duration = len(guide.yaw_rad) / RATE_HZ
    footholds = [foothold(guide, 0.0, side, 0.0, habits) for side in (0, 1)]
    landed, stances = [-np.inf, -np.inf], []
    time, walking, side = 0.3, False, habits.first_side
    while time < duration:
        period, double, speed = step_timing(guide, time)
        swing = period * (1 - double)
        middle = time + swing + period * double + 0.5 * swing
        wanted = [foothold(guide, middle, s, speed, habits) for s in (0, 1)]
        moves = [np.linalg.norm(wanted[s][0] - footholds[s][0]) for s in (0, 1)]
        turns = [wanted[s][1] - footholds[s][1] for s in (0, 1)]
        if not walking:
            if max(moves) < 0.08 and max(map(abs, turns)) < 0.2:
                time += 0.02
                continue
            walking = True
            if max(map(abs, turns)) > 0.35:
                side = int(turns[0] > 0)
        if all(m < 0.01 for m in moves) and all(abs(t) < 0.02 for t in turns):
            walking = False
            time += 0.02
            continue
        if moves[side] >= 0.01 or abs(turns[side]) >= 0.02:
            stances.append(Stance(side, *footholds[side], landed[side], time))
            ankle, yaw = wanted[side]
            out = np.clip(SIDES[side] * (yaw - footholds[1 - side][1]), -TOE_IN_RAD, TOE_APART_RAD)
            yaw = footholds[1 - side][1] + SIDES[side] * float(out)
            missing, outward = clear_of(ankle, yaw, side, *footholds[1 - side])
            footholds[side], landed[side] = (ankle + missing * outward, yaw), time + swing
            time += period
        side = 1 - side
    stances += [Stance(side, *footholds[side], landed[side], np.inf) for side in (0, 1)]
    return sorted(stances, key=lambda stance: (stance.side, stance.land_s))

"""Paths of the feet, which roll and swing over their footsteps, and the centre of pressure.

Foot angles follow normal gait (Perry 1992: heel strike with the toes about 20 deg up, heel off at
35-40 % of the stride); the sole's lowest point is on the floor in stance, by construction.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from world.motions.synthetic import timing
from world.motions.synthetic.footsteps import Stance, clear_of
from world.motions.synthetic.ik import heading
from world.motions.synthetic.rotations import Array
from world.motions.synthetic.skeleton import ANKLE_M, HEEL_M, SIDES, TOE_M

LANDING_M_S = 0.85
"""Forward speed of the heel just before it lands at a comfortable pace (Winter 2009: 0.4-0.9)."""


@dataclass(frozen=True)
class Feet:
    """Paths of both feet: arrays over [2 sides, T]."""

    ankle_m: Array
    """[2, T, 3]."""
    pitch_rad: Array
    """Positive with the toes down, [2, T]."""
    yaw_rad: Array
    planted: Array
    """The sole or one of its edges is on the floor, bool [2, T]."""


def sole_drop(pitch_rad: Array, soften_m: Array | float) -> Array:
    """Distance of the sole's lowest point below the ankle at a pitch, with rounded corners."""
    toe, heel = TOE_M * np.sin(pitch_rad), HEEL_M * np.sin(pitch_rad)
    return (
        ANKLE_M * np.cos(pitch_rad)
        + 0.5 * (toe + heel)
        + np.sqrt(0.25 * (toe - heel) ** 2 + np.square(soften_m))
    )


def rocker_shift(pitch_rad: Array) -> Array:
    """Forward shift of the ankle when the foot pitches about its toe or heel edge."""
    edge = np.where(pitch_rad > 0, TOE_M, HEEL_M)
    return edge - (edge * np.cos(pitch_rad) - ANKLE_M * np.sin(pitch_rad))


def step_pitches(length_m: float) -> tuple[float, float, float]:
    """Heel-strike pitch, toe-off pitch (rad, both positive) and clearance (m) of a step."""
    stride = np.clip(length_m / 1.3, 0.0, 1.1)
    strike = 0.36 * np.clip((stride - 0.2) / 0.8, 0.0, 1.1)
    toe_off = 0.12 + 0.62 * stride
    return float(strike), float(toe_off), float(0.034 - 0.016 * stride)


def feet_paths(stances: list[Stance], times_s: Array) -> Feet:
    """Paths of both feet: a stance foot stands or rolls on a fixed edge, a swing foot swings."""
    frames = len(times_s)
    ankle, pitch = np.zeros((2, frames, 3)), np.zeros((2, frames))
    yaw, planted = np.zeros((2, frames)), np.zeros((2, frames), dtype=bool)
    for side in (0, 1):
        own = [stance for stance in stances if stance.side == side]
        steps = [advance(a, b) for a, b in itertools.pairwise(own)]
        for index, stance in enumerate(own):
            strike = step_pitches(steps[index - 1])[0] if index else 0.0
            toe_off = step_pitches(steps[index])[1] if index < len(steps) else 0.0
            inside = (times_s >= stance.land_s) & (times_s <= stance.lift_s)
            t = times_s[inside]
            roll = np.zeros(len(t))
            if index:
                flat_s = 0.13
                roll -= strike * (1 - timing.minimum_jerk((t - stance.land_s) / flat_s))
            if index < len(steps):
                rise_s = min(0.30, 0.55 * (stance.lift_s - max(stance.land_s, 0.0)))
                s = 1 + (t - stance.lift_s) / rise_s
                rise = timing.quintic(s, rise_s, (0.0, 0.0), (toe_off, lift_rate(toe_off)))
                roll += np.where(s > 0, rise[:, 0], 0.0)
            pitch[side, inside], yaw[side, inside] = roll, stance.yaw_rad
            planted[side, inside] = True
            along = heading(np.array(stance.yaw_rad))[:2]
            ankle[side, inside, :2] = stance.ankle_m + rocker_shift(roll)[:, None] * along
            ankle[side, inside, 2] = sole_drop(roll, 0.0)
            if index < len(steps):
                swing(stance, own[index + 1], times_s, ankle[side], pitch[side], yaw[side])
    for side in (0, 1):
        own = [stance for stance in stances if stance.side == side]
        for before, after in itertools.pairwise(own):
            inside = np.flatnonzero((times_s > before.lift_s) & (times_s < after.land_s))
            give_way(inside, side, ankle, yaw)
    return Feet(ankle, pitch, yaw, planted)


def give_way(inside: NDArray[np.intp], side: int, ankle: Array, yaw: Array) -> None:
    """Bend one swing (frame indices) outward around the stance foot (written in place)."""
    if len(inside) < 3:
        return
    other = 1 - side
    bump = np.sin(np.pi * np.arange(1, len(inside) + 1) / (len(inside) + 1)) ** 2
    needs = [
        clear_of(ankle[side, i, :2], yaw[side, i], side, ankle[other, i, :2], yaw[other, i])
        for i in inside
    ]
    pushes = np.array([need for need, _ in needs]) / np.maximum(bump, 0.35)
    worst = int(np.argmax(pushes))
    ankle[side, inside, :2] += min(pushes[worst], 0.15) * bump[:, None] * needs[worst][1]


def advance(before: Stance, after: Stance) -> float:
    """Forward distance (m, negative backward) of a foot in a step, along its own heading."""
    return float((after.ankle_m - before.ankle_m) @ heading(np.array(after.yaw_rad))[:2])


def lift_rate(toe_off_rad: float) -> float:
    """Pitch rate at toe-off, rad/s: the foot still rolls when it lifts."""
    return 5.0 * toe_off_rad


def swing(
    before: Stance, after: Stance, times_s: Array, ankle: Array, pitch: Array, yaw: Array
) -> None:
    """Write one swing between two stances into a foot's arrays (in place)."""
    inside = (times_s > before.lift_s) & (times_s < after.land_s)
    span = after.land_s - before.lift_s
    s = (times_s[inside] - before.lift_s) / span
    strike, toe_off, clearance = step_pitches(advance(before, after))
    rate = lift_rate(toe_off)
    roll = timing.quintic(s, span, (toe_off, rate), (-strike, 0.0))[:, 0]
    bump = 4 * s * (1 - s)
    start_along, end_along = (heading(np.array(st.yaw_rad))[:2] for st in (before, after))
    nudge = 1e-4
    speed = (rocker_shift(np.array(toe_off)) - rocker_shift(np.array(toe_off - nudge))) / nudge
    pitch[inside] = roll
    yaw[inside] = before.yaw_rad + (after.yaw_rad - before.yaw_rad) * timing.minimum_jerk(s)
    ankle[inside, :2] = timing.quintic(
        s,
        span,
        (
            before.ankle_m + rocker_shift(np.array(toe_off)) * start_along,
            speed * rate * start_along,
        ),
        (
            after.ankle_m + rocker_shift(np.array(-strike)) * end_along,
            LANDING_M_S * np.clip(advance(before, after) / 1.3, 0, 1.2) * end_along,
        ),
    )
    ankle[inside, 2] = sole_drop(roll, 0.015 * bump) + clearance * bump


def pressure(stances: list[Stance], times_s: Array) -> Array:
    """The centre of pressure [T, 2] m: along the stance foot in single support, then to the next
    one."""
    middle_s, knots = 0.4, []
    swings = [
        (a.lift_s, b.land_s, 1 - a.side, advance(a, b) / 1.2)
        for a, b in itertools.pairwise(stances)
        if a.side == b.side
    ]
    swings.sort()

    def foot_point(side: int, time: float, ahead_m: float) -> Array:
        stance = next(
            s for s in stances if s.side == side and s.land_s <= time and time <= s.lift_s
        )
        inward = -SIDES[side] * 0.01
        c, n = np.cos(stance.yaw_rad), np.sin(stance.yaw_rad)
        return stance.ankle_m + np.array([ahead_m * c - inward * n, ahead_m * n + inward * c])

    def both(time: float) -> Array:
        return 0.5 * (foot_point(0, time, 0.035) + foot_point(1, time, 0.035))

    knots.append((-10.0, both(times_s[0])))
    previous_end = -10.0
    for start, end, side, reach in swings:
        if start - previous_end > 2 * middle_s:
            if previous_end > 0:
                knots.append((previous_end + middle_s, both(previous_end + middle_s)))
            knots.append((start - middle_s, both(start - middle_s)))
        reach = float(np.clip(reach, -0.5, 1.0))
        middle, roll = 0.035 + 0.04 * reach, 0.06 * reach
        knots += [
            (start, foot_point(side, start, middle - roll)),
            (end, foot_point(side, end, middle + roll)),
        ]
        previous_end = end
    knots.append((previous_end + middle_s, both(1e9)))
    when = np.array([knot[0] for knot in knots])
    where = np.array([knot[1] for knot in knots])
    return np.stack([np.interp(times_s, when, where[:, axis]) for axis in (0, 1)], -1)

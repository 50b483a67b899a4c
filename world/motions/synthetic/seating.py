"""Sitting clips: walk to a seat, turn, sit down, stay, get up and leave."""

import numpy as np

from world.motions.clip import Clip
from world.motions.objects import Seat
from world.motions.synthetic import timing
from world.motions.synthetic.body import Manner, perform
from world.motions.synthetic.footsteps import RATE_HZ, Guide, plan
from world.motions.synthetic.rotations import Array
from world.motions.synthetic.sitting import STANDING_AHEAD_M, Sitting, overlay
from world.motions.synthetic.walker import FPS, clip, manner, steer


def approach(
    distance_m: float, bearing_rad: float, speed_m_s: float, spin: int
) -> tuple[Array, Array]:
    """Guide position [T, 2] m and yaw [T] of walking to a seat at the origin that faces +x.

    The walk begins `distance_m` from the stand pose in the direction `bearing_rad`, facing it; in
    the last half metre the back is turned to the seat, `spin` +1 leftwards.
    """
    end = np.array([STANDING_AHEAD_M, 0.0])
    away = np.array([np.cos(bearing_rad), np.sin(bearing_rad)])
    start = end + distance_m * away
    front = np.clip((abs(bearing_rad) - 0.6) * 0.45, 0, 0.6)
    # from behind the seat the path leaves room for the body
    round_it = 0.45 * np.clip(abs(bearing_rad) - 1.4, 0.0, 1.0) * np.sign(bearing_rad)
    via = end + np.array([front, round_it]) + 0.25 * distance_m * away
    wait_s, rise_s = 0.8, 0.9 * speed_m_s
    u = np.linspace(0, 1, 400)[:, None]
    curve = (1 - u) ** 2 * start + 2 * u * (1 - u) * via + u**2 * end
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    slow_s = rise_s + 0.7
    cruise_s = max(length[-1] / speed_m_s - 0.5 * (rise_s + slow_s), 0.0)
    total = wait_s + rise_s + cruise_s + slow_s
    first_yaw = np.arctan2(*(via - start)[::-1])
    change = -first_yaw
    change += 2 * np.pi * np.round((spin * 0.5 * np.pi - change) / (2 * np.pi))
    turn_s = 0.8 + abs(change) / 1.6
    turn_start = total - min(1.15, 0.6 * turn_s)
    times = np.arange(int((max(total, turn_start + turn_s) + 0.2) * RATE_HZ)) / RATE_HZ
    speed = speed_m_s * timing.through(
        times, [(wait_s, 0), (wait_s + rise_s, 1), (total - slow_s, 1), (total, 0)]
    )
    along = np.cumsum(speed)
    along *= length[-1] / along[-1]
    position = np.stack([np.interp(along, length, curve[:, i]) for i in (0, 1)], -1)
    tangent = np.gradient(curve, axis=0)
    bend = np.unwrap(np.arctan2(tangent[:, 1], tangent[:, 0]))
    bend += first_yaw - bend[0]
    course = np.interp(along, length, bend)
    fraction = timing.minimum_jerk((times - turn_start) / turn_s)
    return position, (1 - fraction) * course + fraction * (first_yaw + change)


def seated(
    generator: np.random.Generator,
    height_m: float,
    distance_m: float,
    bearing_rad: float,
    spin: int,
    back: bool,
    seated_s: float,
) -> tuple[Guide, Manner, Sitting, float]:
    """Guide to a seat at the origin, seated for `seated_s`, and away; the walker's manner; the sit;
    and the seat's facing, rad."""
    walker = manner(generator)
    position, yaw = approach(distance_m, bearing_rad, generator.uniform(0.85, 1.35), spin)
    waited = Guide(
        np.concatenate([position, np.repeat(position[-1:], 3 * RATE_HZ, 0)]),
        np.concatenate([yaw, np.full(3 * RATE_HZ, yaw[-1])]),
    )
    planted_s = max(step.land_s for step in plan(waited, walker.habits))
    sit = Sitting(
        begin_s=planted_s + generator.uniform(0.05, 0.25),
        seated_s=seated_s,
        height_m=height_m,
        down_s=generator.uniform(1.4, 1.7),
        up_s=generator.uniform(1.15, 1.35),
        lean_rad=-generator.uniform(0.05, 0.16) if back else generator.uniform(-0.02, 0.08),
        flexion_rad=generator.uniform(0.68, 0.78),
        hands_m=generator.uniform(0.20, 0.25),
    )
    still = int((sit.end_s + 0.2) * RATE_HZ) - len(yaw)
    leave = steer(
        [
            (1.2, 0, 0),
            (
                generator.uniform(1.2, 1.9),
                generator.uniform(0.6, 0.9),
                generator.uniform(-0.5, 0.5),
            ),
            (2.1, 0, 0),
        ],
        yaw[-1],
    )
    position = np.concatenate(
        [position, np.repeat(position[-1:], still, 0), position[-1] + leave.position_m]
    )
    yaw = np.concatenate([yaw, np.full(still, yaw[-1]), leave.yaw_rad])
    facing = generator.uniform(-np.pi, np.pi)
    c, s = np.cos(facing), np.sin(facing)
    world = np.array([[c, -s], [s, c]])
    guide = Guide(position @ world.T, yaw + facing)
    return guide, walker, sit, float(facing)


def sitting(
    generator: np.random.Generator,
    height_m: float,
    distance_m: float,
    bearing_rad: float,
    spin: int,
    back: bool,
) -> Clip:
    """A clip that walks up, turns, sits down, stays, stands up and leaves, on a seat anywhere.

    Args:
        height_m: of the seat.
        distance_m: from the begin of the walk to the stand pose before sitting down.
        bearing_rad: direction of the begin of the walk from there; 0 straight before the seat.
        spin: +1 turns the back to the seat leftwards, −1 rightwards.
        back: whether the trunk leans back as on a chair, or is upright as on a stool.
    """
    stay = generator.uniform(3.2, 6.0)
    guide, walker, sit, facing = seated(
        generator, height_m, distance_m, bearing_rad, spin, back, stay
    )
    point = np.array([0.0, 0.0, height_m])
    times = np.arange(len(guide.yaw_rad)) / RATE_HZ
    motion = perform(guide, walker, overlay(sit, point, times))
    seat = Seat(
        point_m=(0.0, 0.0, height_m),
        facing_rad=facing,
        from_frame=int(np.ceil(sit.contact_s * FPS)),
        to_frame=int(sit.off_s * FPS) + 1,
    )
    kind = "seat" if back else "stool"
    return clip(f"sit_{kind}_{100 * height_m:.0f}_{np.degrees(bearing_rad):.0f}", motion, seat)

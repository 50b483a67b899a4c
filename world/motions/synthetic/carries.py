"""Carrying clips: walk to a box, pick it up, carry it, put it down and leave."""

import numpy as np

from world.motions.clip import Clip
from world.motions.objects import Point
from world.motions.synthetic.body import perform
from world.motions.synthetic.carrying import Lift, box_track, free_m
from world.motions.synthetic.footsteps import RATE_HZ, Guide
from world.motions.synthetic.rotations import Array
from world.motions.synthetic.walker import EVERY, clip, landed, manner, steer

#: Time for which the guide stands while the box is picked up or put down, s.
WAIT_S = 4.4


def carrying(
    generator: np.random.Generator,
    size_m: Point,
    heights_m: tuple[float, float],
    distance_m: float,
    turn_rad: float,
) -> Clip:
    """A clip that carries a box from one stand to another.

    Args:
        size_m: the box's depth, width between the hands and height.
        heights_m: of the tops of both stands.
        distance_m: approximate distance of carrying.
        turn_rad: turn on the spot with the box before walking.
    """
    walker = manner(generator)
    speed = generator.uniform(0.8, 1.3)
    speed_m_s = generator.uniform(0.7, 1.15)
    spin = np.sign(turn_rad) * generator.uniform(1.1, 1.4)
    bend, away = generator.uniform(-0.25, 0.25, 2)
    walk_s = max(distance_m / speed_m_s, 0.8)
    leaving = np.sign(generator.uniform(-1, 1)) * generator.uniform(1.1, 1.4)
    pieces = [
        (1.0, 0.0, 0.0),
        (generator.uniform(1.6, 3.6), speed, bend),
        (WAIT_S, 0.0, 0.0),
        (0.7, -0.3, 0.0),
        (abs(turn_rad / spin), 0.0, spin),
        (walk_s, speed_m_s, away),
        (WAIT_S, 0.0, 0.0),
        (0.9, -0.35, 0.0),
        (generator.uniform(0.9, 2.0), 0.1, leaving),
        (generator.uniform(1.2, 2.2), speed, 0.0),
        (2.2, 0.0, 0.0),
    ]
    facing = generator.uniform(-np.pi, np.pi)
    guide = steer(pieces, facing)
    ends = np.cumsum([piece[0] for piece in pieces])
    starts = []
    for before, after in ((ends[1], ends[2]), (ends[5], ends[6])):
        starts.append(max(landed(guide, walker.habits, after - 1.0), before + 0.7) + 0.15)
    box_poses = [
        at_box(guide, start, size_m, h) for start, h in zip(starts, heights_m, strict=True)
    ]
    lift = Lift(
        size_m=size_m,
        mass_kg=generator.uniform(2.0, 6.0),
        take_s=starts[0],
        put_s=starts[1],
        from_m=box_poses[0][0],
        from_rad=box_poses[0][1],
        to_m=box_poses[1][0],
        to_rad=box_poses[1][1],
        above_m=generator.uniform(0.13, 0.20),
        down_s=generator.uniform(0.95, 1.2),
        up_s=generator.uniform(1.05, 1.3),
        lower_s=generator.uniform(1.1, 1.4),
        rise_s=generator.uniform(0.85, 1.0),
    )
    motion = perform(guide, walker, lift=lift)
    times = np.arange(len(guide.yaw_rad)) / RATE_HZ
    if motion.box is None:
        raise AssertionError("a lift has a box")
    track = box_track(lift, *motion.box, times, EVERY)
    name = f"carry_{100 * size_m[1]:.0f}_{100 * heights_m[0]:.0f}_{100 * heights_m[1]:.0f}"
    return clip(name, motion, box=track)


def at_box(guide: Guide, time_s: float, size_m: Point, height_m: float) -> tuple[Array, float]:
    """Centre [3] m and yaw of a box in front of the guide at a time."""
    position, yaw = guide.at(time_s)
    centre_m = height_m + 0.5 * size_m[2]
    ahead = free_m(centre_m) + 0.5 * size_m[0]
    x, y = position + ahead * np.array([np.cos(yaw), np.sin(yaw)])
    return np.array([x, y, centre_m]), yaw

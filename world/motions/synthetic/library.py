"""The set of synthetic clips."""

from dataclasses import replace

import numpy as np

from world.motions.clip import Clip
from world.motions.synthetic.body import perform
from world.motions.synthetic.carries import carrying
from world.motions.synthetic.lies import lying
from world.motions.synthetic.seating import sitting
from world.motions.synthetic.walker import clip, manner, steer

SEAT_HEIGHTS_M = (0.44, 0.40, 0.47, 0.36, 0.42, 0.50, 0.45, 0.38, 0.52)
BED_HEIGHTS_M = (0.45, 0.35, 0.50, 0.40, 0.55, 0.30, 0.42)
STAND_HEIGHTS_M = (
    (0.34, 0.34),
    (0.70, 0.36),
    (0.40, 0.75),
    (0.55, 0.55),
    (0.34, 0.50),
    (0.75, 0.70),
    (0.50, 0.34),
    (0.36, 0.36),
    (0.60, 0.40),
    (0.45, 0.60),
    (0.34, 0.72),
    (0.50, 0.45),
    (0.38, 0.34),
    (0.65, 0.34),
)
"""Heights of both stands."""


def standing(generator: np.random.Generator, duration_s: float) -> Clip:
    """Standing still, with weight shifts and turns of the head."""
    return clip(
        "stand", perform(steer([(duration_s, 0, 0)]), replace(manner(generator), sway_m=0.02))
    )


def walking(generator: np.random.Generator, speed_m_s: float) -> Clip:
    """Walking straight at a speed, from standing to standing."""
    guide = steer([(1.2, 0, 0), (7.0, speed_m_s, 0), (2.4, 0, 0)])
    return clip(f"walk_{speed_m_s:.1f}", perform(guide, manner(generator)))


def curving(generator: np.random.Generator, speed_m_s: float, sign: int) -> Clip:
    """Walking along bends to one side and back."""
    rate = sign * generator.uniform(0.45, 0.75)
    guide = steer(
        [
            (1.1, 0, 0),
            (1.5, speed_m_s, 0),
            (3.0, speed_m_s, rate),
            (1.2, speed_m_s, 0),
            (2.5, speed_m_s, -1.2 * rate),
            (1.0, speed_m_s, 0),
            (2.3, 0, 0),
        ]
    )
    return clip(f"curve_{'right' if sign < 0 else 'left'}", perform(guide, manner(generator)))


def pivoting(generator: np.random.Generator, angle_deg: float) -> Clip:
    """Turning on the spot and back half-way."""
    rate = np.sign(angle_deg) * generator.uniform(1.3, 1.7)
    first = abs(np.radians(angle_deg) / rate)
    guide = steer([(0.8, 0, 0), (first, 0, rate), (1.6, 0, 0), (first / 2, 0, -rate), (1.8, 0, 0)])
    return clip(f"turn_{angle_deg:.0f}", perform(guide, manner(generator)))


def stopping(generator: np.random.Generator, speed_m_s: float) -> Clip:
    """A sequence of starts, stops and turns."""
    rate = generator.choice([-1.4, 1.4])
    guide = steer(
        [
            (1.1, 0, 0),
            (2.2, speed_m_s, 0),
            (1.3, 0, 0),
            (1.2, 0, rate),
            (1.0, 0, 0),
            (2.5, 0.8 * speed_m_s, 0.2 * rate),
            (1.7, 0, 0),
            (1.4, -0.4, 0),
            (1.6, 0, 0),
        ]
    )
    return clip(f"stop_{speed_m_s:.1f}", perform(guide, manner(generator)))


def wandering(generator: np.random.Generator, speed_m_s: float) -> Clip:
    """Brisk walking with bends, an about-turn on the way, a stop and a start."""
    bends = generator.uniform(0.25, 0.8, 4) * generator.permutation([-1.0, -1.0, 1.0, 1.0])
    about_s = generator.uniform(2.5, 3.1)
    about = np.sign(generator.uniform(-1, 1)) * np.pi / about_s
    speeds = speed_m_s * generator.uniform(0.9, 1.1, 5)
    guide = steer(
        [
            (0.9, 0, 0),
            (1.6, speeds[0], 0),
            (2.2, speeds[1], bends[0]),
            (1.4, speeds[1], bends[1]),
            (about_s, 0.35 * speed_m_s, about),
            (2.0, speeds[2], 0),
            (1.5, 0, 0),
            (1.8, speeds[3], bends[2]),
            (2.0, speeds[4], bends[3]),
            (2.2, 0, 0),
        ]
    )
    return clip(f"wander_{speed_m_s:.2f}", perform(guide, manner(generator)))


def locomotion(generator: np.random.Generator) -> list[Clip]:
    """Standing, walking, starting, stopping and turning."""
    clips = [standing(generator, 8.0) for _ in range(2)]
    clips += [walking(generator, speed) for speed in (0.6, 0.8, 1.0, 1.2, 1.4, 1.6)]
    clips += [curving(generator, speed, sign) for speed in (0.8, 1.1, 1.3) for sign in (-1, 1)]
    clips += [pivoting(generator, angle) for angle in (-180, -90, 90, 180)]
    clips += [stopping(generator, speed) for speed in (0.8, 1.2)]
    clips += [wandering(generator, speed) for speed in (1.0, 1.1, 1.2, 1.25, 1.3, 1.4)]
    return clips


def sits(generator: np.random.Generator) -> list[Clip]:
    """Sitting down on seats of nine heights, from all sides, and getting up."""
    clips = []
    for index, height in enumerate(SEAT_HEIGHTS_M * 2):
        spin = 1 if index % 2 else -1
        bearing = -spin * np.radians([5, 35, 70, 125, 95, 50, 20, 140, 110][index % 9])
        distance = float(generator.uniform(1.2, 4.5))
        clips.append(sitting(generator, height, distance, bearing, spin, back=index % 3 != 2))
    return clips


def lies(generator: np.random.Generator) -> list[Clip]:
    """Lying down on beds of seven heights, head left and right, and getting up."""
    clips = []
    for index, height in enumerate(BED_HEIGHTS_M * 2):
        spin = 1 if index % 2 else -1
        bearing = -spin * np.radians([10, 40, 75, 25, 85, 60, 80][index % 7])
        distance = float(generator.uniform(1.2, 3.5))
        left = (index % 2 == 0) == (index < len(BED_HEIGHTS_M))
        clips.append(lying(generator, height, distance, bearing, spin, left))
    return clips


def carries(generator: np.random.Generator) -> list[Clip]:
    """Boxes of several sizes from stand to stand, from knee to chest height."""
    clips = []
    for index, (first, second) in enumerate(STAND_HEIGHTS_M):
        width = float(generator.uniform(0.28, 0.52))
        depth, height = (float(x) for x in generator.uniform((0.2, 0.18), (0.36, 0.34)))
        turn = (1 if index % 2 else -1) * np.radians([180, 60, 120, 30, 90, 150, 100][index % 7])
        distance = float(generator.uniform(1.2, 4.5))
        clips.append(carrying(generator, (depth, width, height), (first, second), distance, turn))
    return clips


def generate(seed: int = 0) -> list[Clip]:
    """The whole set, a pure function of the seed: about 23 minutes of motion.

    Args:
        seed: of the styles, distances, speeds and timings.

    Returns:
        clips at 30 frames per second, floor at z = 0, annotated with their seat, bed or box.
    """
    # one stream per task, so that additions to one do not change the others
    return [
        made
        for part, make in enumerate((locomotion, sits, lies, carries))
        for made in make(np.random.default_rng((seed, part)))
    ]

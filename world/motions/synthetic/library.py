"""The set itself: which clips are made, from which guides, on which seats."""

from dataclasses import replace

import numpy as np

from world.motions.clip import Clip, Seat
from world.motions.synthetic import timing
from world.motions.synthetic.body import Manner, Motion, perform
from world.motions.synthetic.footsteps import RATE_HZ, Guide, Habits, plan
from world.motions.synthetic.rotations import Array, quaternion
from world.motions.synthetic.sitting import STANDING_AHEAD_M, Sitting, overlay

FPS = 30
SOURCE = "inhabit synthetic"
LICENCE = "Apache-2.0"
EVERY = RATE_HZ // FPS

SEAT_HEIGHTS_M = (0.44, 0.40, 0.47, 0.36, 0.42, 0.50, 0.45, 0.38, 0.52)


def clip(name: str, motion: Motion, seat: Seat | None = None) -> Clip:
    """A motion as a clip at 30 frames a second."""
    return Clip(
        name=name,
        fps=FPS,
        root_position_m=motion.root_m[::EVERY].astype(np.float32),
        local_rotation=quaternion(motion.local[::EVERY]).astype(np.float32),
        source=SOURCE,
        licence=LICENCE,
        seat=seat,
    )


def manner(generator: np.random.Generator) -> Manner:
    """A walker with a style of their own."""
    habits = Habits(
        width_m=generator.uniform(0.058, 0.075),
        standing_width_m=generator.uniform(0.08, 0.1),
        toe_out_rad=generator.uniform(0.05, 0.16),
        first_side=int(generator.integers(2)),
    )
    return Manner(
        habits=habits,
        arm_gain=generator.uniform(0.75, 1.15),
        elbow_rad=generator.uniform(0.2, 0.42),
        lean_rad=generator.uniform(0.015, 0.05),
        seed=int(generator.integers(2**31)),
    )


def steer(pieces: list[tuple[float, float, float]], yaw_rad: float = 0.0) -> Guide:
    """A guide that walks the way it faces: (duration s, speed m/s, turning rate rad/s) in turn."""
    durations = np.array([piece[0] for piece in pieces])
    frames = int(durations.sum() * RATE_HZ)
    index = np.searchsorted(np.cumsum(durations), np.arange(frames) / RATE_HZ, side="right")
    values = np.array(pieces)[np.minimum(index, len(pieces) - 1), 1:]
    speed = timing.smooth(values[:, 0], 0.38, RATE_HZ)
    rate = timing.smooth(values[:, 1], 0.22, RATE_HZ)
    yaw = yaw_rad + np.cumsum(rate) / RATE_HZ
    velocity = speed[:, None] * np.stack([np.cos(yaw), np.sin(yaw)], -1)
    return Guide(np.cumsum(velocity, 0) / RATE_HZ, yaw)


def standing(generator: np.random.Generator, duration_s: float) -> Clip:
    """Standing still, shifting the weight and looking about."""
    return clip(
        "stand", perform(steer([(duration_s, 0, 0)]), replace(manner(generator), sway_m=0.02))
    )


def walking(generator: np.random.Generator, speed_m_s: float) -> Clip:
    """From standing, straight on at a speed, to standing."""
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
    """Starts, stops and turns in a row."""
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


def approach(
    distance_m: float, bearing_rad: float, speed_m_s: float, spin: int
) -> tuple[Array, Array]:
    """Guide position [T, 2] and yaw [T] of walking to a seat at the origin that faces +x.

    Starts `distance_m` from the place to stand, in the direction `bearing_rad` from it, facing it;
    the last half metre is walked while turning the back to the seat, `spin` +1 leftwards.
    """
    end = np.array([STANDING_AHEAD_M, 0.0])
    away = np.array([np.cos(bearing_rad), np.sin(bearing_rad)])
    start = end + distance_m * away
    front = np.clip((abs(bearing_rad) - 0.6) * 0.45, 0, 0.6)
    via = end + np.array([front, 0.0]) + 0.25 * distance_m * away
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
    share = timing.minimum_jerk((times - turn_start) / turn_s)
    return position, (1 - share) * course + share * (first_yaw + change)


def sitting(
    generator: np.random.Generator,
    height_m: float,
    distance_m: float,
    bearing_rad: float,
    spin: int,
    back: bool,
) -> Clip:
    """Walk up, turn, sit down, stay, stand up and step away, on a seat somewhere in the world."""
    walker = manner(generator)
    position, yaw = approach(distance_m, bearing_rad, generator.uniform(0.8, 1.25), spin)
    waited = Guide(
        np.concatenate([position, np.repeat(position[-1:], 3 * RATE_HZ, 0)]),
        np.concatenate([yaw, np.full(3 * RATE_HZ, yaw[-1])]),
    )
    planted_s = max(step.land_s for step in plan(waited, walker.habits))
    sit = Sitting(
        begin_s=planted_s + generator.uniform(0.35, 0.6),
        seated_s=generator.uniform(3.2, 6.0),
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
    point = np.array([0.0, 0.0, height_m])
    times = np.arange(len(yaw)) / RATE_HZ
    motion = perform(guide, walker, overlay(sit, point, times))
    seat = Seat(
        point_m=(0.0, 0.0, height_m),
        facing_rad=float(facing),
        from_frame=int(np.ceil(sit.contact_s * FPS)),
        to_frame=int(sit.off_s * FPS) + 1,
    )
    kind = "seat" if back else "stool"
    return clip(f"sit_{kind}_{100 * height_m:.0f}_{np.degrees(bearing_rad):.0f}", motion, seat)


def generate(seed: int = 0) -> list[Clip]:
    """The whole set, the same for the same seed: about nine minutes of motion.

    Args:
        seed: of the styles, distances, speeds and timings.

    Returns:
        clips at 30 frames a second, floor at z = 0; those that sit carry their seat.
    """
    generator = np.random.default_rng(seed)
    clips = [standing(generator, 10.0) for _ in range(2)]
    clips += [walking(generator, speed) for speed in (0.6, 0.8, 1.0, 1.2, 1.4, 1.6)]
    clips += [curving(generator, speed, sign) for speed in (0.8, 1.1, 1.3) for sign in (-1, 1)]
    clips += [pivoting(generator, angle) for angle in (-180, -90, 90, 180)]
    clips += [stopping(generator, speed) for speed in (0.8, 1.2)]
    for index, height in enumerate(SEAT_HEIGHTS_M * 2):
        spin = 1 if index % 2 else -1
        bearing = -spin * np.radians([5, 35, 70, 20, 95, 50][index % 6])
        distance = float(generator.uniform(1.0, 3.5))
        clips.append(sitting(generator, height, distance, bearing, spin, back=index % 3 != 2))
    return clips

"""Common parts of the synthetic clips: walkers, guides and frame rate."""

import numpy as np

from world.motions.clip import Clip
from world.motions.objects import Bed, BoxTrack, Seat
from world.motions.synthetic import timing
from world.motions.synthetic.body import Manner, Motion
from world.motions.synthetic.footsteps import RATE_HZ, Guide, Habits, plan
from world.motions.synthetic.rotations import quaternion

FPS = 30
SOURCE = "inhabit synthetic"
LICENCE = "Apache-2.0"
EVERY = RATE_HZ // FPS


def clip(
    name: str,
    motion: Motion,
    seat: Seat | None = None,
    bed: Bed | None = None,
    box: BoxTrack | None = None,
) -> Clip:
    """A motion as a clip at 30 frames per second."""
    return Clip(
        name=name,
        fps=FPS,
        root_position_m=motion.root_m[::EVERY].astype(np.float32),
        local_rotation=quaternion(motion.local[::EVERY]).astype(np.float32),
        source=SOURCE,
        licence=LICENCE,
        seat=seat,
        bed=bed,
        box=box,
    )


def manner(generator: np.random.Generator) -> Manner:
    """A random manner of walking."""
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
    """A guide along its heading, from pieces (duration s, speed m/s, turning rate rad/s)."""
    durations = np.array([piece[0] for piece in pieces])
    frames = int(durations.sum() * RATE_HZ)
    index = np.searchsorted(np.cumsum(durations), np.arange(frames) / RATE_HZ, side="right")
    values = np.array(pieces)[np.minimum(index, len(pieces) - 1), 1:]
    speed = timing.smooth(values[:, 0], 0.38, RATE_HZ)
    rate = timing.smooth(values[:, 1], 0.22, RATE_HZ)
    yaw = yaw_rad + np.cumsum(rate) / RATE_HZ
    velocity = speed[:, None] * np.stack([np.cos(yaw), np.sin(yaw)], -1)
    return Guide(np.cumsum(velocity, 0) / RATE_HZ, yaw)


def landed(guide: Guide, habits: Habits, before_s: float) -> float:
    """Time of the last landing before a time; 0 without one."""
    times = [step.land_s for step in plan(guide, habits)]
    return max((t for t in times if 0.0 < t <= before_s), default=0.0)

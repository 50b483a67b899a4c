"""Sitting down, staying seated and standing up, as an overlay of standing in front of a seat.

Sit-to-stand takes about 2 s and flexes the trunk by 35-45 deg (Schenkman et al. 1990; Kerr et al.
1997): flexion on the seat, seat-off near a third of it, extension. Sitting down is its mirror in
time, a little slower, and ends by leaning back.
"""

from dataclasses import dataclass

import numpy as np

from world.motions.synthetic import timing
from world.motions.synthetic.footsteps import ANKLE_BEHIND_M
from world.motions.synthetic.ik import two_link
from world.motions.synthetic.rotations import Array, transpose, turn
from world.motions.synthetic.skeleton import FOREARM_M, OFFSETS_M, UPPER_ARM_M

ROOT_ABOVE_SEAT_M = 0.06
"""Height of the pelvis origin above the seat: the thighs' capsules (radius 0.055 m) rest on it."""

FEET_AHEAD_M = 0.27
"""Distance of the ankles ahead of the seated pelvis: about 13 cm behind the knees, so that standing
up is possible."""

STANDING_AHEAD_M = FEET_AHEAD_M + ANKLE_BEHIND_M
"""Distance of the guide ahead of the seat's point before sitting down."""


@dataclass(frozen=True)
class Overlay:
    """Sitting as an overlay of walking and standing. All arrays over [T]."""

    depth: Array
    """0 standing to 1 on the seat."""
    seat_root_m: Array
    """Pelvis origin when seated, world, [3]."""
    flexion_rad: Array
    """Trunk flexion, positive forward."""
    hands: Array
    """0 hanging to 1 on the thighs."""
    reach_m: Array
    """Distance of the hands down the thigh."""


def nothing(frames: int) -> Overlay:
    """An overlay that changes nothing."""
    zero = np.zeros(frames)
    return Overlay(zero, np.zeros(3), zero, zero, zero + 0.3)


@dataclass(frozen=True)
class Sitting:
    """Times and shape of one sit."""

    begin_s: float
    """Time at which the descent begins."""
    seated_s: float
    """Duration of contact with the seat."""
    height_m: float
    """Of the seat's surface."""
    down_s: float = 1.5
    """Duration from the first movement to contact."""
    up_s: float = 1.25
    """Duration from seat-off to standing."""
    lean_rad: float = -0.10
    """Trunk flexion at rest; negative leans back."""
    flexion_rad: float = 0.72
    """Greatest trunk flexion."""
    hands_m: float = 0.23
    """Distance of the resting hands down the thigh."""

    @property
    def contact_s(self) -> float:
        """Time at which the pelvis reaches the seat."""
        return self.begin_s + self.down_s

    @property
    def off_s(self) -> float:
        """Time at which the pelvis leaves the seat."""
        return self.contact_s + self.seated_s

    @property
    def end_s(self) -> float:
        """Time at which the body stands again."""
        return self.off_s + self.up_s


def overlay(sitting: Sitting, point_m: Array, times_s: Array) -> Overlay:
    """The profiles of a sit over time, on a seat whose surface below the pelvis is `point_m`
    [3]."""
    t = sitting
    depth = timing.through(
        times_s, [(t.begin_s, 0.0), (t.contact_s, 1.0), (t.off_s, 1.0), (t.end_s, 0.0)]
    )
    flexion = timing.through(
        times_s,
        [
            (t.begin_s - 0.1, 0.0),
            (t.begin_s + 0.85 * t.down_s, t.flexion_rad),
            (t.contact_s + 0.8, t.lean_rad),
            (t.off_s - 0.75, t.lean_rad),
            (t.off_s + 0.12 * t.up_s, t.flexion_rad),
            (t.end_s + 0.1, 0.0),
        ],
    )
    hands = timing.through(
        times_s,
        [
            (t.begin_s + 0.3 * t.down_s, 0.0),
            (t.contact_s + 0.3, 1.0),
            (t.off_s - 0.2, 1.0),
            (t.off_s + 0.8 * t.up_s, 0.0),
        ],
    )
    reach = timing.through(
        times_s,
        [
            (t.begin_s, 0.39),
            (t.contact_s, 0.39),
            (t.contact_s + 0.9, t.hands_m),
            (t.off_s - 0.8, t.hands_m),
            (t.off_s, 0.39),
        ],
    )
    root = np.asarray(point_m, dtype=np.float64) + np.array([0.0, 0.0, ROOT_ABOVE_SEAT_M])
    return Overlay(depth, root, flexion, hands, reach)


def hands_on_thighs(local: Array, root: Array, side: int, reach_m: Array) -> tuple[Array, Array]:
    """Upper arm rotation [T, 3, 3] in the torso and elbow angle [T] with a hand on its thigh.

    `local` must hold the pelvis, torso and leg rotations already.
    """
    upper, thigh = 3 + 3 * side, (9, 12)[side]
    pelvis = local[:, 0]
    leg = pelvis @ local[:, thigh]
    torso = pelvis @ local[:, 1]
    sign = (-1.0, 1.0)[side]
    on_thigh = np.stack([np.full(len(root), 0.105), np.full(len(root), sign * 0.02), -reach_m], -1)
    hand = root + turn(pelvis, OFFSETS_M[thigh]) + turn(leg, on_thigh)
    shoulder = root + turn(pelvis, OFFSETS_M[1]) + turn(torso, OFFSETS_M[upper])
    inward = turn(torso, np.tile([0.8, -sign * 0.6, 0.0], (len(root), 1)))
    rotation, elbow = two_link(shoulder, hand, inward, UPPER_ARM_M, FOREARM_M, -1)
    return transpose(torso) @ rotation, elbow

"""Lying down from the edge of a bed and getting up, as an overlay of sitting.

The trunk turns and leans towards the pillow over the arm of that side, both legs are lifted
together onto the bed, and the back comes to rest last; rising is the same path back, pushed by the
same arm. Adults do it in many ways (Ford-Smith & VanSant 1993); legs together and pushing with the
near arm are the commonest of Mount et al. 2006.
"""

from dataclasses import dataclass

import numpy as np

from world.motions.synthetic import timing
from world.motions.synthetic.body import Motion
from world.motions.synthetic.footsteps import RATE_HZ
from world.motions.synthetic.ik import heading, two_link
from world.motions.synthetic.rotations import (
    Array,
    about,
    blend,
    transpose,
    turn,
)
from world.motions.synthetic.skeleton import (
    FOREARM_M,
    OFFSETS_M,
    SHIN_M,
    SIDES,
    THIGH_M,
    UPPER_ARM_M,
)

ROOT_ABOVE_BED_M = 0.085
"""Height of the pelvis origin above the mattress when lying: the pelvis (radius 0.09 m) rests on
it."""
RISE_RAD = np.radians(4.0)
"""Incline of the trunk at which pelvis and chest (radius 0.11 m) both rest."""
ANKLE_ABOVE_BED_M = 0.065
"""Height of the ankles of stretched legs above the mattress: calves rest on it."""
HEAD_M = OFFSETS_M[1, 2] + OFFSETS_M[2, 2] + 0.175
"""Distance from the pelvis to the centre of the head along a straight trunk."""


@dataclass(frozen=True)
class Lying:
    """Parameters of one rest on a bed, in the frame of the seat on its edge, x off the bed."""

    begin_s: float
    """Time at which the seated body begins to turn."""
    down_s: float
    """Duration until the back rests."""
    rest_s: float
    """Duration of lying."""
    up_s: float
    """Duration until the body sits on the edge again."""
    head_left: bool
    """Whether the head lies on the left of the character that sits on the edge."""
    inward_m: float
    """Distance of the lying pelvis from the seated one towards the middle of the bed."""
    along_m: float = 0.0
    """Distance of the lying pelvis from the seated one towards the head."""
    knees_m: tuple[float, float] = (0.0, 0.0)
    """Height by which the right and the left knee are drawn up; the ankle is nearer by twice
    that."""
    belly: tuple[float, float] = (0.0, 0.0)
    """Position of the right and the left hand: 0 beside the hip, 1 on the belly."""

    @property
    def down_by_s(self) -> float:
        """Time at which the back rests."""
        return self.begin_s + self.down_s

    @property
    def up_from_s(self) -> float:
        """Time at which the body begins to rise."""
        return self.down_by_s + self.rest_s

    @property
    def end_s(self) -> float:
        """Time at which the body sits on the edge again."""
        return self.up_from_s + self.up_s

    def fraction(self, times_s: Array, begin: float, end: float) -> Array:
        """[T], 0 seated to 1 lying: a move between two fractions of lying down, mirrored in time on
        getting up."""
        down, up = self.down_s, self.up_s
        knots = [(self.begin_s + begin * down, 0.0), (self.begin_s + end * down, 1.0)]
        knots += [(self.end_s - end * up, 1.0), (self.end_s - begin * up, 0.0)]
        return timing.through(times_s, knots)


def lie_down(motion: Motion, lying: Lying, seat_m: Array, facing_rad: float) -> Motion:
    """A motion that sits at `seat_m` [3], facing off the bed, with lying down during the sit.

    Before and after it the motion is unchanged: seated, feet on the floor.
    """
    frames = len(motion.root_m)
    times = np.arange(frames) / RATE_HZ
    side = 1.0 if lying.head_left else -1.0
    root, local = motion.root_m.copy(), motion.local.copy()
    ahead, left = heading(np.array(facing_rad)), heading(np.array(facing_rad + 0.5 * np.pi))

    turned = lying.fraction(times, 0.16, 0.92)
    leaned = lying.fraction(times, 0.12, 1.0)
    moved = lying.fraction(times, 0.15, 0.85)
    sunk = lying.fraction(times, 0.3, 1.0)
    goal = seat_m - lying.inward_m * ahead + side * lying.along_m * left
    goal += np.array([0.0, 0.0, ROOT_ABOVE_BED_M])
    fraction = np.stack([moved, moved, sunk], -1)
    root = root + fraction * (goal - root)

    yaw = facing_rad - side * 0.5 * np.pi * turned
    pitch = -(0.5 * np.pi - RISE_RAD) * leaned
    # the small lean and sway of the seated pelvis fade into the lying one
    base = blend(transpose(_yaw(facing_rad, frames)) @ motion.local[:, 0], _same(frames), leaned)
    local[:, 0] = about("z", yaw) @ about("y", pitch) @ base
    curl = 0.30 * _hump(leaned)
    aside = side * 0.22 * _hump(lying.fraction(times, 0.0, 0.8))
    local[:, 1] = (
        about("x", aside) @ about("y", curl) @ blend(motion.local[:, 1], _same(frames), leaned)
    )
    nod = 0.35 * _hump(leaned) - 0.02 * leaned
    local[:, 2] = about("y", nod) @ blend(motion.local[:, 2], _same(frames), leaned)
    _legs(motion, lying, local, root, yaw, times, seat_m[2])
    _arms(motion, lying, local, root, times, seat_m, ahead, side * left)
    inside = (times >= lying.begin_s) & (times <= lying.end_s)
    return Motion(
        np.where(inside[:, None], root, motion.root_m),
        np.where(inside[:, None, None, None], local, motion.local),
        motion.feet,
        motion.pressure_m,
    )


def _yaw(yaw_rad: float, frames: int) -> Array:
    return about("z", np.full(frames, yaw_rad))


def _same(frames: int) -> Array:
    return np.tile(np.eye(3), (frames, 1, 1))


def _hump(fraction: Array) -> Array:
    """A profile that is 0 at both ends of a move and 1 half-way."""
    return 4.0 * fraction * (1.0 - fraction)


def _legs(
    motion: Motion,
    lying: Lying,
    local: Array,
    root: Array,
    yaw: Array,
    times_s: Array,
    height_m: float,
) -> None:
    """Rotations of both legs from the floor onto the bed, written into `local`."""
    frames = len(times_s)
    head_right = not lying.head_left
    for side in (0, 1):
        thigh = (9, 12)[side]
        # the leg on the pillow's side moves first: the other one would block it
        first = (side == 0) == head_right
        delay = 0.0 if first else 0.07
        lifted = lying.fraction(times_s, 0.16 + delay, 0.54 + delay)
        along = lying.fraction(times_s, 0.45 + delay, 0.97)
        forward, across = heading(yaw), heading(yaw + 0.5 * np.pi)
        knee = lying.knees_m[side]
        stretched = np.sqrt(0.80**2 - (1.9 * knee) ** 2) if knee else 0.815
        reach = 0.47 + along * (stretched - 0.47)
        up = np.full(frames, height_m + ANKLE_ABOVE_BED_M) + 0.16 * (1 - along)
        path = (
            root
            + turn_about(forward, reach)
            + turn_about(across, np.full(frames, SIDES[side] * 0.095))
        )
        path[:, 2] = up
        planted = motion.feet.ankle_m[side]
        ankle = planted + lifted[:, None] * (path - planted)
        hip = root + turn(local[:, 0], OFFSETS_M[thigh])
        # seated thighs are level: the plane of the leg is nearly upright already
        knees = (motion.local[:, 0] @ motion.local[:, thigh])[..., 0]
        knees = knees + lifted[:, None] * (np.array([0.0, 0.0, 1.0]) - knees)
        rotation, flexion = two_link(hip, ankle, knees, THIGH_M, SHIN_M, 1)
        upright = transpose(local[:, 0]) @ rotation
        local[:, thigh] = upright
        local[:, thigh + 1] = about("y", flexion)
        shin = rotation @ local[:, thigh + 1]
        flat = about("z", motion.feet.yaw_rad[side]) @ about("y", motion.feet.pitch_rad[side])
        relaxed = about("y", np.full(frames, 0.35 - 0.25 * bool(knee)))
        local[:, thigh + 2] = blend(transpose(shin) @ flat, relaxed, lifted)


def turn_about(direction: Array, length_m: Array) -> Array:
    """Vectors [T, 3] of given lengths [T] along directions [T, 3]."""
    return length_m[:, None] * direction


def _arms(
    motion: Motion,
    lying: Lying,
    local: Array,
    root: Array,
    times_s: Array,
    seat_m: Array,
    ahead: Array,
    headward: Array,
) -> None:
    """Rotations of the arms, written into `local`: the arm of the pillow's side props the trunk,
    the other one follows; both rest beside the hips or on the belly."""
    frames = len(times_s)
    torso = local[:, 0] @ local[:, 1]
    prop = lying.fraction(times_s, 0.0, 0.25)
    home = lying.fraction(times_s, 0.40, 0.85)
    for side in (0, 1):
        upper = 3 + 3 * side
        props = (side == 1) == lying.head_left
        shoulder = root + turn(local[:, 0], OFFSETS_M[1]) + turn(torso, OFFSETS_M[upper])
        beside = np.array([0.02, SIDES[side] * 0.26, 0.02])
        belly = np.array([0.15, SIDES[side] * 0.06, 0.20])
        resting = beside + lying.belly[side] * (belly - beside)
        hand = root + turn(local[:, 0], np.tile(resting, (frames, 1)))
        hand[:, 2] = np.maximum(hand[:, 2], seat_m[2] + 0.045)
        if props:
            point = seat_m - 0.10 * ahead + 0.38 * headward + [0.0, 0.0, 0.045]
            hand = point + home[:, None] * (hand - point)
            weight = prop
        else:
            weight = lying.fraction(times_s, 0.0, 0.55)
            # clear of the rising thigh
            clear = _hump(lying.fraction(times_s, 0.05, 0.95))
            out = turn(local[:, 0], np.tile([0.05, SIDES[side] * 0.22, 0.12], (frames, 1)))
            hand = hand + clear[:, None] * out
        outward = turn(torso, np.tile([0.5, -SIDES[side] * 1.0, 0.0], (frames, 1)))
        rotation, elbow = two_link(shoulder, hand, outward, UPPER_ARM_M, FOREARM_M, -1)
        local[:, upper] = blend(motion.local[:, upper], transpose(torso) @ rotation, weight)
        before = np.arctan2(motion.local[:, upper + 1, 0, 2], motion.local[:, upper + 1, 0, 0])
        local[:, upper + 1] = about("y", before + weight * (elbow - before))

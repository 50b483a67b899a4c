"""The whole body over its footsteps: a pendulum for the trunk, legs by inverse kinematics.

The centre of mass follows the inverted pendulum over the footsteps' centre of pressure, so that
balance, sway and the lean before a step come from mechanics. Pelvis list and turn follow Winter
2009 (4-5 deg each, the trunk against them), arms Murray 1967 (against the legs).
"""

from dataclasses import dataclass, field, replace

import numpy as np

from world.motions.synthetic import carrying, timing
from world.motions.synthetic.carrying import Lift
from world.motions.synthetic.footsteps import RATE_HZ, Guide, Habits, plan
from world.motions.synthetic.gait import Feet, feet_paths, pressure
from world.motions.synthetic.ik import heading, two_link
from world.motions.synthetic.rotations import (
    Array,
    about,
    blend,
    quaternion,
    rotation_vector,
    transpose,
    turn,
)
from world.motions.synthetic.sitting import Overlay, hands_on_thighs, nothing
from world.motions.synthetic.skeleton import (
    LEG_M,
    MASSES_KG,
    OFFSETS_M,
    SHIN_M,
    SIDES,
    THIGH_M,
    centre_of_mass,
    forward,
)

STANDING_M = 0.878
"""Pelvis height when standing: knees bent by about 8 degrees."""
REACH = 0.996
"""Greatest extension of a leg in walking, as a fraction of its length."""


@dataclass(frozen=True)
class Manner:
    """One walker's style."""

    habits: Habits = field(default_factory=Habits)
    arm_gain: float = 0.95
    """Shoulder angle per metre that the other foot is ahead, rad/m."""
    elbow_rad: float = 0.30
    lean_rad: float = 0.03
    """Trunk lean at 1 m/s."""
    sway_m: float = 0.0
    """Standard deviation of the weight shift from foot to foot; for standing only."""
    seed: int = 0
    """Seed of the slow drift of trunk, head and weight."""


@dataclass(frozen=True)
class Motion:
    """A finished motion at RATE_HZ."""

    root_m: Array
    """[T, 3]."""
    local: Array
    """Rotation of each body in its parent's frame, [T, 15, 3, 3]."""
    feet: Feet
    pressure_m: Array
    """Planned centre of pressure, [T, 2]."""
    box: tuple[Array, Array] | None = None
    """A lifted box's centre [T, 3] and yaw [T]."""


def perform(
    guide: Guide, manner: Manner, overlay: Overlay | None = None, lift: Lift | None = None
) -> Motion:
    """The motion of the whole body along a guide, with an overlay such as sitting, or with a box
    that it lifts and carries."""
    frames = len(guide.yaw_rad)
    times = np.arange(frames) / RATE_HZ
    overlay = overlay or nothing(frames)
    depth = carrying.bend(lift, times) if lift else np.zeros(frames)
    load = carrying.weight(lift, times)[:, None] if lift else np.zeros((frames, 1))
    overlay = replace(overlay, flexion_rad=overlay.flexion_rad + carrying.FLEXION_RAD * depth)
    stances = plan(guide, manner.habits)
    feet = feet_paths(stances, times)
    centre = pressure(stances, times)
    if manner.sway_m:
        centre = centre + sway(yaw_rad=guide.yaw_rad, manner=manner)
    mass = timing.pendulum(centre, 0.9, RATE_HZ)
    yaw = timing.smooth(0.5 * guide.yaw_rad + 0.5 * feet.yaw_rad.mean(0), 0.15, RATE_HZ)
    velocity = np.gradient(mass, 1 / RATE_HZ, axis=0)
    upright = 1 - overlay.depth
    local = np.tile(np.eye(3), (frames, 15, 1, 1))
    trunk(local, feet, yaw, velocity, overlay, manner)
    offset = np.zeros((frames, 2))
    root = np.zeros((frames, 3))
    box = None
    for _ in range(5 if lift else 3):
        root = pelvis_path(mass - offset, feet, local[:, 0], overlay, carrying.SQUAT_M * depth)
        legs(local, root, feet, yaw)
        arms(local, root, feet, yaw, overlay, manner)
        if lift:
            box = carrying.track(lift, root, yaw, times)
            hold(local, root, lift, box, times)
        positions, rotations = forward(root, local)
        centre_m = centre_of_mass(positions, rotations)
        if box:
            centre_m = (MASSES_KG.sum() * centre_m + load * box[0]) / (MASSES_KG.sum() + load)
        shift = centre_m[:, :2] - root[:, :2]
        free = (upright > 0.999) & ((lift is not None) | (np.abs(overlay.flexion_rad) < 1e-3))
        shift = np.stack([np.interp(times, times[free], shift[free, i]) for i in (0, 1)], -1)
        offset = timing.smooth(shift, 0.12 if lift else 0.3, RATE_HZ)
    if box and lift:
        box = (carrying.where_held(lift, box[0], forward(root, local)[0], times), box[1])
    return Motion(root, local, feet, centre, box)


def sway(yaw_rad: Array, manner: Manner) -> Array:
    """Slow shifts [T, 2] m of the centre of pressure in standing, mostly sideways."""
    drift = np.random.default_rng(manner.seed + 1)
    frames = len(yaw_rad)
    across, along = (timing.wander(drift, frames, 0.6, RATE_HZ) for _ in range(2))
    ahead = heading(yaw_rad)[:, :2]
    left = np.stack([-ahead[:, 1], ahead[:, 0]], -1)
    shift = np.clip(across, -2, 2)[:, None] * left + 0.3 * np.clip(along, -2, 2)[:, None] * ahead
    return manner.sway_m * shift


def pelvis_path(
    upright_m: Array, feet: Feet, rotation: Array, overlay: Overlay, squat_m: Array
) -> Array:
    """Pelvis origin [T, 3] m: as high as both legs reach, at most at standing height, less the
    depth of a squat; or on a seat."""
    caps = [np.full(len(upright_m), STANDING_M)]
    for side in (0, 1):
        arm = turn(rotation, OFFSETS_M[(9, 12)[side]])
        apart = np.linalg.norm(upright_m + arm[:, :2] - feet.ankle_m[side, :, :2], axis=-1)
        high = np.sqrt(np.maximum((REACH * LEG_M) ** 2 - apart**2, 0.2))
        caps.append(feet.ankle_m[side, :, 2] + high - arm[:, 2])
    depth = overlay.depth
    caps[0] = caps[0] - squat_m
    low = timing.lower_envelope(np.min(caps, 0), 0.055, RATE_HZ)
    standing = np.concatenate([upright_m, low[:, None]], -1)
    back = depth**1.25
    fraction = np.stack([back, back, depth], -1)
    return standing + fraction * (overlay.seat_root_m - standing)


def trunk(
    local: Array, feet: Feet, yaw: Array, velocity: Array, overlay: Overlay, manner: Manner
) -> None:
    """Pelvis, torso and head rotations, written into `local`."""
    frames = len(yaw)
    drift = np.random.default_rng(manner.seed)
    ahead = heading(yaw)[:, :2]
    stride = np.sum((feet.ankle_m[0] - feet.ankle_m[1])[:, :2] * ahead, -1)
    stride = timing.smooth(stride, 0.05, RATE_HZ)
    lifted = timing.smooth(
        feet.planted[0].astype(float) - feet.planted[1].astype(float), 0.07, RATE_HZ
    )
    forward = np.sum(velocity * ahead, -1)
    surge = timing.smooth(np.gradient(forward, 1 / RATE_HZ), 0.25, RATE_HZ)
    brisk = np.clip(np.abs(timing.smooth(forward, 0.2, RATE_HZ)), 0, 1.3)
    flexion = overlay.flexion_rad
    turned = 0.13 * stride
    list_rad = 0.055 * lifted * brisk
    wander = [0.012 * timing.wander(drift, frames, 0.7, RATE_HZ) for _ in range(4)]
    lean = manner.lean_rad * brisk + np.clip(0.05 * surge, -0.08, 0.08)
    local[:, 0] = (
        about("z", yaw + turned) @ about("y", 0.55 * flexion + 0.3 * lean) @ about("x", list_rad)
    )
    local[:, 1] = (
        about("z", -1.7 * turned + wander[0])
        @ about("y", 0.45 * flexion + 0.7 * lean + 0.5 * wander[1])
        @ about("x", -0.9 * list_rad)
    )
    glance = np.clip(np.roll(yaw, -int(0.35 * RATE_HZ)) - yaw, -0.6, 0.6)
    glance[-int(0.35 * RATE_HZ) :] = 0.0
    glance = timing.smooth(glance, 0.12, RATE_HZ)
    local[:, 2] = about("z", glance + 0.7 * turned + 2 * wander[2]) @ about(
        "y", -0.45 * np.clip(flexion, -0.2, 1) - 0.5 * lean + 0.05 + wander[3]
    )


def legs(local: Array, root: Array, feet: Feet, yaw: Array) -> None:
    """Hip, knee and ankle rotations that put both feet on their paths, written into `local`."""
    for side in (0, 1):
        thigh = (9, 12)[side]
        hip = root + turn(local[:, 0], OFFSETS_M[thigh])
        forward = heading(yaw) + heading(feet.yaw_rad[side])
        rotation, knee = two_link(hip, feet.ankle_m[side], forward, THIGH_M, SHIN_M, 1)
        local[:, thigh] = transpose(local[:, 0]) @ rotation
        local[:, thigh + 1] = about("y", knee)
        foot = about("z", feet.yaw_rad[side]) @ about("y", feet.pitch_rad[side])
        local[:, thigh + 2] = transpose(rotation @ local[:, thigh + 1]) @ foot


def hold(local: Array, root: Array, lift: Lift, box: tuple[Array, Array], times_s: Array) -> None:
    """Arms with both hands on a box, or between it and hanging, written into `local`."""
    for side in (0, 1):
        upper = 3 + 3 * side
        hand, grip = carrying.hands_on(lift, *box, times_s, side)
        elbow = rotation_vector(quaternion(local[:, upper + 1]))[:, 1]
        local[:, upper], local[:, upper + 1] = carrying.arm(
            local, root, side, hand, (local[:, upper], -elbow), grip
        )


def arms(
    local: Array, root: Array, feet: Feet, yaw: Array, overlay: Overlay, manner: Manner
) -> None:
    """Arms that swing against the legs, or with hands on the thighs, written into `local`."""
    ahead = heading(yaw)
    for side in (0, 1):
        swung = np.sum((feet.ankle_m[1 - side] - feet.ankle_m[side]) * ahead, -1)
        swung = timing.smooth(swung, 0.09, RATE_HZ)
        flexion = manner.arm_gain * 0.5 * swung - 0.03
        elbow = manner.elbow_rad + 0.45 * np.clip(swung + 0.2, 0, None)
        elbow = timing.smooth(elbow, 0.05, RATE_HZ)
        upper = 3 + 3 * side
        sign = SIDES[side]
        hanging = (
            about("x", sign * (0.11 + 0 * flexion))
            @ about("y", -flexion)
            @ about("z", -sign * 0.15 + 0 * flexion)
        )
        resting, bend = hands_on_thighs(local, root, side, overlay.reach_m)
        local[:, upper] = hanging
        local[:, upper + 1] = about("y", -elbow)
        if overlay.hands.any():
            local[:, upper] = blend(hanging, resting, overlay.hands)
            local[:, upper + 1] = about("y", -elbow + overlay.hands * (elbow + bend))

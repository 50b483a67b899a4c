"""Picking a box up, carrying it and putting it down, as an overlay of standing and walking.

Without instruction people mostly lift from a semi-squat, between stoop and squat, with the load 40
cm or so ahead of the ankles (Burgess-Limerick & Abernethy 1998): trunk and knees flex together
here, as deep as the hands need. The box stays close to the body, and the body leans back until
both together balance over the feet.
"""

from dataclasses import dataclass

import numpy as np

from world.motions.objects import BoxTrack, Point
from world.motions.synthetic import timing
from world.motions.synthetic.footsteps import RATE_HZ
from world.motions.synthetic.ik import heading, two_link
from world.motions.synthetic.rotations import (
    Array,
    about,
    blend,
    quaternion,
    transpose,
    turn,
)
from world.motions.synthetic.skeleton import FOREARM_M, OFFSETS_M, SIDES, UPPER_ARM_M

HAND_M = 0.04
"""Radius of a hand: distance of its centre from the face that it presses."""
FREE_M = (0.26, 0.19)
"""Distance from the guide to the near face of a low and of a high box, with room for knees and
toes."""
FREE_AT_M = (0.5, 0.9)
"""Heights of the box's centre for both."""
OPEN_M = 0.07
"""Distance of each open hand from its face before the grasp."""
STANDING_M = 0.878
REACH_M = 0.475
"""Distance from shoulder to hand in the deepest bend: elbows slightly bent (of 0.53 m)."""
FLEXION_RAD, SQUAT_M = 1.0, 0.30
"""Trunk flexion and lowering of the pelvis in a bend of 1."""


@dataclass(frozen=True)
class Lift:
    """A box with the times and positions of picking up and putting down."""

    size_m: Point
    """Depth, width between the hands, height."""
    mass_kg: float
    take_s: float
    """Time at which the bend to pick up begins."""
    put_s: float
    """Time at which the bend to put down begins."""
    from_m: Array
    """Initial position of the centre, world, [3]."""
    from_rad: float
    to_m: Array
    """Final position of the centre, world, [3]."""
    to_rad: float
    above_m: float = 0.15
    """Height of the carried centre above the pelvis."""
    down_s: float = 1.05
    """Time from the begin of a bend to the grasp."""
    up_s: float = 1.15
    """Time from the grasp to upright."""
    lower_s: float = 1.25
    """Time from upright to the release."""
    rise_s: float = 1.0

    @property
    def grasp_s(self) -> float:
        """Time at which both hands press the box."""
        return self.take_s + self.down_s + 0.15

    @property
    def lifted_s(self) -> float:
        """Time at which the body is upright with the box."""
        return self.grasp_s + 0.1 + self.up_s

    @property
    def release_s(self) -> float:
        """Time at which the hands let go."""
        return self.put_s + self.lower_s + 0.1

    @property
    def end_s(self) -> float:
        """Time at which the body is upright without the box."""
        return self.release_s + 0.2 + self.rise_s

    @property
    def carried_m(self) -> Array:
        """Centre of the carried box relative to the pelvis, heading frame, [3]."""
        return np.array([0.20 + 0.5 * self.size_m[0], 0.0, self.above_m])


def free_m(height_m: float) -> float:
    """Distance from the guide to the near face of a box, by the height of its centre."""
    return float(np.interp(height_m, FREE_AT_M, FREE_M))


def bend_for(height_m: float, ahead_m: float) -> float:
    """Depth of the bend (0 upright, about 1 deep) that brings the hands to a height, m, and
    distance ahead of the standing pelvis, m."""

    def distance(depth: float) -> float:
        flexion, squat = FLEXION_RAD * depth, SQUAT_M * depth
        low, high = 0.55 * flexion, flexion
        back = 0.04 + 0.245 * np.sin(high)
        forward = 0.236 * np.sin(low) + 0.2435 * np.sin(high) - back
        up = STANDING_M - squat + 0.236 * np.cos(low) + 0.2435 * np.cos(high)
        return float(np.hypot(ahead_m - forward, up - height_m))

    depths = np.linspace(0.0, 1.3, 131)
    near = [d for d in depths if distance(float(d)) <= REACH_M]
    return float(near[0]) if near else float(depths[np.argmin([distance(d) for d in depths])])


def bend(lift: Lift, times_s: Array) -> Array:
    """Depth of the bend, [T]."""
    t = lift
    first, second = (
        bend_for(float(centre[2]), free_m(float(centre[2])) + 0.5 * t.size_m[0])
        for centre in (t.from_m, t.to_m)
    )
    return timing.through(
        times_s,
        [
            (t.take_s, 0.0),
            (t.take_s + t.down_s, first),
            (t.grasp_s + 0.1, first),
            (t.lifted_s - 0.05, 0.0),
            (t.put_s, 0.0),
            (t.put_s + t.lower_s, second),
            (t.release_s + 0.15, second),
            (t.end_s, 0.0),
        ],
    )


def weight(lift: Lift, times_s: Array) -> Array:
    """The load on the hands, kg, [T]."""
    t = lift
    knots = [(t.grasp_s, 0.0), (t.grasp_s + 0.35, 1.0)]
    knots += [(t.release_s - 0.35, 1.0), (t.release_s, 0.0)]
    return t.mass_kg * timing.through(times_s, knots)


def track(lift: Lift, root_m: Array, yaw_rad: Array, times_s: Array) -> tuple[Array, Array]:
    """Centre [T, 3] m and yaw [T] of the box, for a pelvis at `root_m` [T, 3]."""
    t = lift
    calm = timing.smooth(root_m, 0.14, RATE_HZ)
    calm_yaw = timing.smooth(yaw_rad, 0.14, RATE_HZ)
    ahead, aside = heading(calm_yaw), heading(calm_yaw + 0.5 * np.pi)
    x, y, z = t.carried_m
    carried = calm + x * ahead + y * aside + [0.0, 0.0, z]
    lifting, lowering = t.grasp_s + 0.1, t.release_s - 0.1
    knots = [(lifting, 0.0), (t.lifted_s - 0.05, 1.0), (t.put_s, 1.0), (lowering, 0.0)]
    fraction = timing.through(times_s, knots)
    middle = 0.5 * (t.lifted_s + t.put_s)
    rest = np.where((times_s < middle)[:, None], t.from_m, t.to_m)
    turned = np.where(times_s < middle, t.from_rad, t.to_rad)
    turned = calm_yaw + np.angle(np.exp(1j * (turned - calm_yaw)))
    centre = rest + fraction[:, None] * (carried - rest)
    yaw = turned + fraction * (calm_yaw - turned)
    return centre, yaw


def hands_on(
    lift: Lift, centre_m: Array, yaw_rad: Array, times_s: Array, side: int
) -> tuple[Array, Array]:
    """Target of a hand on or beside the box [T, 3] m, and its weight [T]."""
    t = lift
    opening = timing.through(
        times_s,
        [
            (t.take_s + t.down_s - 0.25, 1.0),
            (t.grasp_s, 0.0),
            (t.release_s, 0.0),
            (t.release_s + 0.3, 1.0),
        ],
    )
    grip = timing.through(
        times_s,
        [
            (t.take_s + 0.1, 0.0),
            (t.take_s + t.down_s - 0.1, 1.0),
            (t.release_s + 0.15, 1.0),
            (t.end_s - 0.1, 0.0),
        ],
    )
    out = SIDES[side] * (0.5 * t.size_m[1] + HAND_M + OPEN_M * opening)
    return centre_m + out[:, None] * heading(yaw_rad + 0.5 * np.pi), grip


def arm(
    local: Array, root: Array, side: int, hand_m: Array, hanging: tuple[Array, Array], grip: Array
) -> tuple[Array, Array]:
    """Upper arm rotation [T, 3, 3] in the torso and elbow rotation [T, 3, 3], with a hand between
    hanging (0 of `grip`) and `hand_m` [T, 3] (1).

    `local` must hold the pelvis and torso rotations already.
    """
    upper = 3 + 3 * side
    pelvis = local[:, 0]
    torso = pelvis @ local[:, 1]
    shoulder = root + turn(pelvis, OFFSETS_M[1]) + turn(torso, OFFSETS_M[upper])
    # elbows point down and a little outward
    inward = turn(torso, np.tile([1.0, -SIDES[side] * 0.55, 0.35], (len(root), 1)))
    rotation, elbow = two_link(shoulder, hand_m, inward, UPPER_ARM_M, FOREARM_M, -1)
    first = blend(hanging[0], transpose(torso) @ rotation, grip)
    flexed = about("y", -hanging[1] + grip * (elbow + hanging[1]))
    return first, flexed


def where_held(lift: Lift, centre_m: Array, positions_m: Array, times_s: Array) -> Array:
    """Centre of the box [T, 3] m, between the hands of `positions_m` [T, 15, 3] during the hold,
    since short arms hold it nearer than planned."""
    middle = 0.5 * (positions_m[:, 5] + positions_m[:, 8])
    knots = [(lift.grasp_s, 0.0), (lift.grasp_s + 0.1, 1.0)]
    knots += [(lift.release_s - 0.1, 1.0), (lift.release_s, 0.0)]
    return centre_m + timing.through(times_s, knots)[:, None] * (middle - centre_m)


def box_track(lift: Lift, centre_m: Array, yaw_rad: Array, times_s: Array, every: int) -> BoxTrack:
    """The track of the box for a clip, every `every`-th frame."""
    rotation = quaternion(about("z", yaw_rad))
    pose = np.concatenate((centre_m, rotation), axis=1)[::every].astype(np.float32)
    held = (times_s >= lift.grasp_s) & (times_s <= lift.release_s)
    return BoxTrack(pose, lift.size_m, held[::every])

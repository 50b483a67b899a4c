"""Lying clips: walk to a bed, sit on its edge, lie down, rest, get up and leave."""

from dataclasses import replace

import numpy as np

from world.motions.clip import Clip
from world.motions.objects import Bed
from world.motions.synthetic.body import perform
from world.motions.synthetic.footsteps import RATE_HZ
from world.motions.synthetic.lying import HEAD_M, RISE_RAD, Lying, lie_down
from world.motions.synthetic.seating import seated
from world.motions.synthetic.sitting import overlay
from world.motions.synthetic.walker import FPS, clip


def lying(
    generator: np.random.Generator,
    height_m: float,
    distance_m: float,
    bearing_rad: float,
    spin: int,
    head_left: bool,
) -> Clip:
    """A clip that walks up, turns, sits on the edge, lies down on the back, rests, gets up and
    leaves.

    Args:
        height_m: of the mattress.
        distance_m: from the begin of the walk to the stand pose before sitting down.
        bearing_rad: direction of the begin of the walk from there; 0 straight off the bed.
        spin: +1 turns the back to the bed leftwards, −1 rightwards.
        head_left: whether the head lies on the left of the character that sits on the edge.
    """
    down, up = generator.uniform(2.6, 3.4), generator.uniform(2.4, 3.0)
    rest = generator.uniform(3.5, 6.0)
    pause = generator.uniform(0.35, 0.9), generator.uniform(0.7, 1.2)
    guide, walker, sit, facing = seated(
        generator,
        height_m,
        distance_m,
        bearing_rad,
        spin,
        back=False,
        seated_s=pause[0] + down + rest + up + pause[1],
    )
    sit = replace(sit, lean_rad=0.05)
    drawn = generator.uniform(0.1, 0.2) * (generator.uniform(size=2) < 0.4)
    belly = generator.uniform(size=2) < 0.4
    way = Lying(
        begin_s=sit.contact_s + pause[0],
        down_s=down,
        rest_s=rest,
        up_s=up,
        head_left=head_left,
        inward_m=generator.uniform(0.12, 0.22),
        along_m=generator.uniform(-0.05, 0.1),
        knees_m=(float(drawn[0]), float(drawn[1])),
        belly=(float(belly[0]), float(belly[1])),
    )
    point = np.array([0.0, 0.0, height_m])
    times = np.arange(len(guide.yaw_rad)) / RATE_HZ
    motion = perform(guide, walker, overlay(sit, point, times))
    motion = lie_down(motion, way, point, facing)
    side = 1.0 if head_left else -1.0
    ahead = np.array([np.cos(facing), np.sin(facing)])
    headward = side * np.array([-ahead[1], ahead[0]])
    hip = -way.inward_m * ahead + way.along_m * headward
    head = hip + HEAD_M * np.cos(RISE_RAD) * headward
    bed = Bed(
        hip_m=(float(hip[0]), float(hip[1]), height_m),
        head_m=(float(head[0]), float(head[1]), height_m),
        facing_rad=facing,
        from_frame=int(np.ceil(way.down_by_s * FPS)),
        to_frame=int(way.up_from_s * FPS) + 1,
    )
    name = f"lie_{'left' if head_left else 'right'}_{100 * height_m:.0f}"
    return clip(f"{name}_{np.degrees(bearing_rad):.0f}", motion, bed=bed)

"""Joint ranges, feet and smoothness of the synthetic clips, clip by clip."""

import numpy as np

from tests.support.world.synthetic import Posed, standing
from world.character import model as character
from world.motions.synthetic import rotations, skeleton

RANGES_DEG = {
    "torso": ((-60, 60), (-60, 90), (-50, 50)),
    "head": ((-50, 50), (-40, 60), (-45, 45)),
    "right_upper_arm": ((-180, 45), (-180, 60), (-90, 90)),
    "left_upper_arm": ((-45, 180), (-180, 60), (-90, 90)),
    "right_lower_arm": ((0, 0), (-160, 0), (0, 0)),
    "left_lower_arm": ((0, 0), (-160, 0), (0, 0)),
    "right_hand": ((0, 0), (0, 0), (0, 0)),
    "left_hand": ((0, 0), (0, 0), (0, 0)),
    "right_thigh": ((-60, 15), (-140, 60), (-60, 35)),
    "left_thigh": ((-15, 60), (-140, 60), (-35, 60)),
    "right_shin": ((0, 0), (0, 160), (0, 0)),
    "left_shin": ((0, 0), (0, 160), (0, 0)),
    "right_foot": ((-30, 30), (-55, 55), (-40, 40)),
    "left_foot": ((-30, 30), (-55, 55), (-40, 40)),
}
"""The character's joint ranges about x, y and z; hinges turn about y alone."""


def test_joints_stay_in_their_ranges_and_hinges_on_their_axis(every: list[Posed]) -> None:
    for one in every:
        angles = np.degrees(rotations.rotation_vector(one.clip.local_rotation.astype(np.float64)))
        for name, ranges in RANGES_DEG.items():
            joint = angles[:, character.BODIES.index(name)]
            for axis, (low, high) in enumerate(ranges):
                assert joint[:, axis].min() >= low - 0.1, (one.clip.name, name, "xyz"[axis])
                assert joint[:, axis].max() <= high + 0.1, (one.clip.name, name, "xyz"[axis])


def test_lowest_point_of_the_feet_is_on_the_floor(every: list[Posed]) -> None:
    for one in every:
        clip, positions, world = one.clip, one.positions, one.world
        soles = np.stack([skeleton.sole_corners(positions, world, side) for side in (0, 1)])
        lowest = soles[..., 2].min((0, 2))
        assert lowest.min() > -0.002, clip.name
        # on a bed they are off it
        up = np.ones(clip.frames, bool) if clip.bed is None else standing(clip)
        assert lowest[up].max() < 0.002, clip.name


def test_no_joint_is_faster_than_15_rad_s_and_nothing_jumps(every: list[Posed]) -> None:
    for one in every:
        clip, local = one.clip, one.local
        step = rotations.transpose(local[:-1]) @ local[1:]
        speed = rotations.rotation_vector(rotations.quaternion(step)) * clip.fps
        assert np.linalg.norm(speed, axis=-1).max() < 15.0, clip.name
        assert np.abs(np.diff(speed, axis=0)).max() < 13.0, (
            clip.name
        )  # a swing leg's change in one frame
        root = np.diff(clip.root_position_m.astype(np.float64), axis=0) * clip.fps
        assert np.linalg.norm(root, axis=-1).max() < 2.0, clip.name
        assert np.linalg.norm(np.diff(root, axis=0), axis=-1).max() < 0.6, clip.name
        quaternions = clip.local_rotation
        assert (np.sum(quaternions[1:] * quaternions[:-1], -1) > 0).all(), clip.name

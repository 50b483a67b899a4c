"""Planted feet, clip by clip."""

import numpy as np

from tests.support.world.synthetic import Posed, standing
from world.motions.synthetic import skeleton


def test_what_touches_the_floor_does_not_slide(every: list[Posed]) -> None:
    for one in every:
        clip, positions, world = one.clip, one.positions, one.world
        speeds = []
        for side in (0, 1):
            corners = skeleton.sole_corners(positions, world, side)
            touching = (corners[:-1, :, 2] < 0.006) & (corners[1:, :, 2] < 0.006)
            moved = np.linalg.norm(np.diff(corners[..., :2], axis=0), axis=-1) * clip.fps
            speeds.append(moved[touching])
        assert np.concatenate(speeds).mean() < 0.02, clip.name


def test_feet_do_not_pass_through_each_other(every: list[Posed]) -> None:
    for one in every:
        clip, positions, world = one.clip, one.positions, one.world
        right, left = (skeleton.sole_corners(positions, world, side)[..., :2] for side in (0, 1))
        apart = np.full(clip.frames, -np.inf)
        for foot in (11, 14):  # separating axes of two rectangles
            for axis in (0, 1):
                line = world[:, foot, :2, axis]
                line = line / np.linalg.norm(line, axis=-1, keepdims=True)
                a, b = (np.einsum("tcj,tj->tc", corners, line) for corners in (right, left))
                apart = np.maximum(apart, np.maximum(a.min(1) - b.max(1), b.min(1) - a.max(1)))
        assert apart[standing(clip)].min() > 0.0, clip.name

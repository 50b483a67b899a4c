"""Clips that carry: the box goes from one stand to the other, and rests on both."""

import numpy as np
import pytest

from world.motions.synthetic import carries
from world.motions.synthetic.walker import steer


def test_the_box_goes_from_stand_to_stand() -> None:
    size, heights = (0.35, 0.5, 0.3), (0.45, 0.75)
    clip = carries.carrying(np.random.default_rng(2), size, heights, 2.0, 1.2)
    assert clip.box is not None and clip.box.size_m == size
    centre, held = clip.box.pose[:, :3], clip.box.held
    first, last = np.flatnonzero(held)[[0, -1]]
    assert centre[0, 2] == pytest.approx(heights[0] + size[2] / 2, abs=1e-3)
    assert centre[-1, 2] == pytest.approx(heights[1] + size[2] / 2, abs=1e-3)
    assert (
        not np.ptp(centre[:first], axis=0).any() and np.ptp(centre[last + 2 :], axis=0).max() < 1e-6
    )
    assert 1.0 < np.linalg.norm(centre[-1, :2] - centre[0, :2]) < 4.0
    assert centre[held, 2].max() > max(heights) + size[2] / 2 + 0.05


def test_a_box_stands_before_the_guide() -> None:
    guide = steer([(2.0, 0.0, 0.0)], yaw_rad=np.pi / 2)
    centre, yaw = carries.at_box(guide, 1.0, (0.4, 0.5, 0.3), 0.5)
    position, _ = guide.at(1.0)
    assert yaw == pytest.approx(np.pi / 2) and centre[2] == pytest.approx(0.65)
    assert centre[0] == pytest.approx(position[0], abs=1e-6) and centre[1] > position[1] + 0.2

"""Where the soles of a clip are, against mocap that walks."""

import numpy as np
import pytest

from tests.support.samp_clips import needs_samp, prepared
from world.motions.fit import poses


def test_runs_of_true() -> None:
    assert poses.stretches(np.array([1, 1, 0, 1, 0, 0, 1], bool)) == [(0, 2), (3, 4), (6, 7)]
    assert poses.stretches(np.zeros(3, bool)) == []


@needs_samp
@pytest.mark.parametrize("name", ["armchair004", "chair_mo006", "locomotion_random"])
def test_mocap_walks_on_the_floor(name: str) -> None:
    clip = prepared(name)
    position, rotation = poses.body_poses(clip)
    lowest = poses.sole_heights(position, rotation).min(axis=1)
    speed = np.linalg.norm(np.gradient(clip.root_position_m[:, :2], axis=0), axis=1) * clip.fps
    walking = (clip.root_position_m[:, 2] > 0.72) & (speed > 0.3)
    assert walking.sum() > 100
    assert np.percentile(np.abs(lowest[walking]), 95) < 0.02

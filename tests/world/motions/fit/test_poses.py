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


def test_smoothing_keeps_a_steady_speed_up_to_the_ends() -> None:
    """A straight line is its own smoothing; mirrored ends made it begin at rest."""
    line = 0.7 * np.arange(40.0) - 3.0
    np.testing.assert_allclose(poses.smooth(line, 2.0), line, atol=1e-12)
    wave = np.sin(0.1 * np.arange(60.0))
    speed = np.gradient(poses.smooth(wave, 1.0))
    assert abs(speed[0] - 0.1) < 0.004

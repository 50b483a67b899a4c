"""Clips come to 30 Hz and onto the floor."""

from dataclasses import replace

import numpy as np

from world.motions.clip import Clip
from world.motions.fit import floor


def test_resampling_keeps_the_motion(sitting: Clip) -> None:
    doubled = floor.resampled(sitting, 60)
    again = floor.resampled(doubled, 30)
    frames = min(again.frames, sitting.frames)
    np.testing.assert_allclose(
        again.root_position_m[:frames], sitting.root_position_m[:frames], atol=1e-5
    )
    dot = np.abs((again.local_rotation[:frames] * sitting.local_rotation[:frames]).sum(-1))
    np.testing.assert_allclose(dot, 1.0, atol=1e-4)


def test_a_drifting_floor_is_mended(sitting: Clip) -> None:
    drift = 0.04 * np.sin(np.linspace(0, 3, sitting.frames)) - 0.05
    moved = replace(
        sitting,
        root_position_m=sitting.root_position_m + drift[:, None].astype(np.float32) * [0, 0, 1],
    )
    mended = floor.floor_mended(replace(moved, root_position_m=moved.root_position_m.astype("f4")))
    error = mended.root_position_m[:, 2] - sitting.root_position_m[:, 2]
    assert np.abs(error).max() < 0.02

"""Clips that lie: the bed is where the trunk rests, to the side that was asked for."""

import numpy as np
import pytest

from world.motions.synthetic.lies import lying


@pytest.mark.parametrize("head_left", [True, False])
def test_the_head_lies_on_the_requested_side(head_left: bool) -> None:
    clip = lying(np.random.default_rng(1), 0.5, 1.2, 0.0, 1, head_left)
    bed = clip.bed
    assert bed is not None and bed.hip_m[2] == bed.head_m[2] == 0.5
    ahead = np.array([np.cos(bed.facing_rad), np.sin(bed.facing_rad)])
    along = np.array(bed.head_m[:2]) - np.array(bed.hip_m[:2])
    left = ahead[0] * along[1] - ahead[1] * along[0]
    assert (left > 0) == head_left and 0.5 < np.linalg.norm(along) < 0.9
    assert along @ ahead == pytest.approx(0.0, abs=1e-9)
    rest = clip.root_position_m[bed.from_frame : bed.to_frame]
    assert bed.to_frame - bed.from_frame > 3 * clip.fps
    np.testing.assert_allclose(rest[:, :2].mean(0), bed.hip_m[:2], atol=0.12)
    assert 0.5 < rest[:, 2].mean() < 0.75 and clip.root_position_m[0, 2] > 0.8

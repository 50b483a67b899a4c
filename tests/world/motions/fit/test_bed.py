"""The bed of a clip is found where it was."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.samp_clips import FOLDER, needs_samp
from tests.support.world.objects_in_clips import shaken
from world.motions import load
from world.motions.clip import Clip
from world.motions.fit.bed import find_beds
from world.motions.uses.bed import BED


@pytest.mark.parametrize("angle_deg_", [0.0, 2.0])
def test_the_bed_is_found_within_two_centimetres_and_five_degrees(
    lain: Clip, angle_deg_: float
) -> None:
    known = lain.bed
    clip = shaken(lain, 0.005 if angle_deg_ else 0.0, np.deg2rad(angle_deg_))
    (found,) = find_beds(replace(clip, bed=None))
    assert known is not None
    np.testing.assert_allclose(found.hip_m, known.hip_m, atol=0.02)
    np.testing.assert_allclose(found.head_m, known.head_m, atol=0.02 if not angle_deg_ else 0.04)
    turn = (found.facing_rad - known.facing_rad + np.pi) % (2 * np.pi) - np.pi
    assert abs(turn) < np.deg2rad(5)
    assert found.from_frame <= known.from_frame < known.to_frame <= found.to_frame


def test_lying_on_the_floor_is_no_bed(lain: Clip) -> None:
    lower = replace(
        lain, bed=None, root_position_m=lain.root_position_m - np.array([0, 0, 0.44], np.float32)
    )
    assert find_beds(lower) == []


@needs_samp
@pytest.mark.parametrize("name", ["lie_down_3", "lie_down_12"])
def test_mocap_lies_on_a_low_bed(name: str) -> None:
    (clip,) = load.clips((str(FOLDER / f"{name}.npz"),), BED)
    assert clip.bed is not None
    assert 0.12 < clip.bed.height_m < 0.25
    apart = np.linalg.norm(np.subtract(clip.bed.head_m, clip.bed.hip_m))
    assert 0.5 < apart < 0.7
    assert (clip.bed.to_frame - clip.bed.from_frame) / clip.fps > 8

"""Clips of the character, read so that they can be mended."""

from pathlib import Path

import numpy as np

from tests.support import small_clips
from world.motions import load
from world.motions.formats import character_npz


def test_a_clip_is_a_recording_of_the_own_body(tmp_path: Path) -> None:
    path = sorted(small_clips.write(tmp_path).glob("*.npz"))[0]
    clip, found = load.read(path), character_npz.read(path)
    assert found.own_body and found.unit_m == 1.0 and found.up == "z"
    assert (found.fps, found.frames) == (clip.fps, clip.frames)
    np.testing.assert_allclose(found.position[:, 0], clip.root_position_m, atol=1e-6)

"""Our own clips are recordings of themselves."""

from pathlib import Path

import numpy as np

from tests.support import small_clips
from tests.support.world.motion_files import same_motion
from world.motions import clip_file
from world.motions.clip import Clip
from world.motions.formats import own, registry


def test_clips_are_recordings_of_themselves(tmp_path: Path, walking: Clip) -> None:
    clip_file.write(tmp_path / "c.npz", walking)
    same_motion(registry.read(tmp_path / "c.npz"), walking)


def test_a_clip_is_a_recording_of_the_own_body(tmp_path: Path) -> None:
    path = sorted(small_clips.write(tmp_path).glob("*.npz"))[0]
    clip, found = clip_file.read(path), own.read(path)
    assert found.own_body and found.unit_m == 1.0 and found.up == "z"
    assert (found.fps, found.frames) == (clip.fps, clip.frames)
    np.testing.assert_allclose(found.position[:, 0], clip.root_position_m, atol=1e-6)

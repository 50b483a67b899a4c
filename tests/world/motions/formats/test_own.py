"""Our own clips are recordings of themselves."""

from pathlib import Path

from tests.support.world.motion_files import same_motion
from world.motions.clip import Clip
from world.motions.formats import registry


def test_clips_are_recordings_of_themselves(tmp_path: Path, walking: Clip) -> None:
    from world.motions import clip_file

    clip_file.write(tmp_path / "c.npz", walking)
    same_motion(registry.read(tmp_path / "c.npz"), walking)

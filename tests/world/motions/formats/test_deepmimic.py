"""DeepMimic clips are the character's own motion."""

from pathlib import Path

import pytest

from tests.support import foreign_motions
from tests.support.world.motion_files import same_motion
from world.motions.clip import Clip
from world.motions.formats import registry


def test_deepmimic_is_the_characters_own_motion(tmp_path: Path, walking: Clip) -> None:
    read = registry.read(foreign_motions.deepmimic_of(tmp_path / "w.txt", walking))
    assert read.fps == pytest.approx(walking.fps)
    same_motion(read, walking, 2e-4)

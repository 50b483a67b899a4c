"""The nearest mocap of a pose."""

import math
from pathlib import Path

import numpy as np
import pytest

from console.play.browser.ghost import Ghost, placed
from console.play.source import heading
from tests.support import small_clips
from world.character import model as character
from world.motions import load
from world.realism.measures import Motion


def test_the_nearest_mocap_of_a_clip_is_itself(tmp_path: Path) -> None:
    library = load.library([str(small_clips.write(tmp_path))], mirror=False)
    ghost = Ghost(library)
    at = 40
    match = ghost.nearest(Motion(library.qpos[at : at + 2], library.qvel[at : at + 2]))
    assert match.distance < 1e-3 and match.clip == library.clips[0].name
    np.testing.assert_allclose(match.qpos, library.qpos[at + 1].double(), atol=1e-5)
    where = character.standing_qpos()
    where[:2], where[3:7] = (3.0, -2.0), (math.cos(0.4), 0.0, 0.0, math.sin(0.4))
    moved = placed(match.qpos, where)
    assert (*moved[:2], heading(moved)) == pytest.approx((3.0, -2.0, 0.8))
    assert moved[2] == match.qpos[2]
    np.testing.assert_array_equal(moved[7:], match.qpos[7:])

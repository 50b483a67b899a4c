"""Acclaim by hand, and CMU's proportions."""

from pathlib import Path

import numpy as np
import pytest

from tests.support.samp_clips import FOLDER
from tests.support.world.motion_files import AMC, ASF
from world.motions.formats import acclaim, landmarks, registry

SHARED = FOLDER.parent


def test_acclaim_by_hand(tmp_path: Path) -> None:
    (tmp_path / "07.asf").write_text(ASF)
    path = tmp_path / "07_01.amc"
    path.write_text(AMC)
    read = registry.read(path)
    assert read.names == ("root", "upper", "lower", "lower_end")
    np.testing.assert_allclose(read.position[0], [[1, 2, 3], [1, 2, 3], [1, 4, 3], [4, 4, 3]])
    # upper turns by 90 about its own x, which its axis (90 about z) puts along the root's y; the
    # root then turns all by 90 about z: (0, 2, 0) stays (0, 2, 0) and goes to (-2, 0, 0);
    # (3, 0, 0) about y goes to (0, 0, -3), about z it stays
    np.testing.assert_allclose(read.position[1, 2], [-1, 2, 3], atol=1e-9)
    np.testing.assert_allclose(read.position[1, 3], [-1, 2, 0], atol=1e-9)


@pytest.mark.skipif(not (SHARED / "cmu").is_dir(), reason="no ../shared/motions")
def test_acclaim_of_cmu_has_cmus_proportions() -> None:
    read = registry.read(SHARED / "cmu" / "07_01.amc")
    joint = landmarks.find(read)
    leg = np.linalg.norm(
        read.position[:, joint["left_hip"]] - read.position[:, joint["left_knee"]], axis=-1
    ) + np.linalg.norm(
        read.position[:, joint["left_knee"]] - read.position[:, joint["left_ankle"]], axis=-1
    )
    # INDEX.csv, measured elsewhere: 0.809 m
    np.testing.assert_allclose(leg * 0.0254 / 0.45, 0.809, atol=0.001)
    assert read.frames == 316
    assert acclaim.beside(SHARED / "cmu" / "07_01.amc").name == "07.asf"

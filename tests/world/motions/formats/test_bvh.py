"""BVH by hand and by another library."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support import foreign_motions
from tests.support.samp_clips import FOLDER
from world.motions.formats import registry

SHARED = FOLDER.parent


def test_bvh_by_hand(tmp_path: Path) -> None:
    # the root turns by 90 degrees about z, its child by 90 about x: (1, 0, 0) -> (0, 1, 0)
    names, parents = ("Hips", "Chest", "Tip"), (-1, 0, 1)
    offset = np.array([[5.0, 6, 7], [1, 0, 0], [0, 2, 0]])
    local = np.tile(np.eye(3), (3, 3, 1, 1))
    local[1:, 0] = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    local[1:, 1] = Rotation.from_euler("x", 90, degrees=True).as_matrix()
    root = np.tile([10.0, 20, 30], (3, 1))
    path = foreign_motions.write_bvh(tmp_path / "a.bvh", root, local, offset, 25, names, parents)
    read = registry.read(path)
    assert read.names[:3] == names
    assert read.fps == pytest.approx(25, rel=1e-3)
    # the root's OFFSET is not added to its channels
    np.testing.assert_allclose(read.position[1, 0], [10, 20, 30])
    np.testing.assert_allclose(read.position[1, 1], [10, 21, 30], atol=1e-9)
    # (0, 2, 0) in the child: about x to (0, 0, 2), about z it stays
    np.testing.assert_allclose(read.position[1, 2], [10, 21, 32], atol=1e-9)


@pytest.mark.skipif(not (SHARED / "accad").is_dir(), reason="no ../shared/motions")
@pytest.mark.parametrize("name", ["accad/Male1_B20_WalkWithBox.bvh", "cmu/08_01.bvh"])
def test_bvh_positions_are_the_librarys(name: str) -> None:
    import pybvh

    read = registry.read(SHARED / name)
    theirs = pybvh.read_bvh_file(SHARED / name, world_up="+y").node_positions()
    # frame 0 of CMU's conversion is a pose put in front
    added = len(theirs) - read.frames
    assert added == (1 if name.startswith("cmu") else 0)
    np.testing.assert_allclose(read.position, theirs[added:], atol=1e-4)

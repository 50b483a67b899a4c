"""BVH of clips: any rotation survives, and angles follow on from one another."""

from pathlib import Path

import numpy as np
import pybvh
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from console.animation import bvh
from console.app import main
from tests.support.console.motions import bodies, sits, wild, y_up
from world import rotations
from world.character import kinematics
from world.character import model as character
from world.motions import load
from world.motions.formats import bvh as reader


def matrices(angles: np.ndarray) -> np.ndarray:
    return Rotation.from_euler("ZXY", angles.reshape(-1, 3), degrees=True).as_matrix()


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 720.0))
def test_continuous_angles_are_the_same_rotations(seed: int, spread: float) -> None:
    angles = np.random.default_rng(seed).normal(0.0, spread, (12, 4, 3))
    found = bvh.continuous(angles)
    np.testing.assert_allclose(matrices(found), matrices(angles), atol=1e-9)
    assert (np.abs(np.diff(found, axis=0)) <= 180.0 + 1e-6).all()


def test_a_turn_about_x_goes_on_beyond_the_pole() -> None:
    """Past 90 degrees a decomposition flips the other two angles; the file must not."""
    turn = np.linspace(0.0, 403.0, 81)
    read = Rotation.from_euler("X", turn[:, None], degrees=True).as_euler("ZXY", degrees=True)
    assert np.abs(np.diff(read[:, 0])).max() > 170.0, "the decomposition does flip"
    found = bvh.continuous(read[:, None])
    np.testing.assert_allclose(found[:, 0, 1], turn, atol=1e-6)
    np.testing.assert_allclose(found[:, 0, [0, 2]], 0.0, atol=1e-6)


def test_random_rotations_come_back(tmp_path: Path) -> None:
    random = wild()
    path = tmp_path / "wild.bvh"
    path.write_text(bvh.text(random))
    read = reader.read(path)
    local = rotations.matrix(torch.from_numpy(random.local_rotation).double())
    wanted, _ = kinematics.forward(torch.from_numpy(random.root_position_m).double(), local)
    x, y, z = np.moveaxis(wanted.numpy(), -1, 0)
    columns = [read.names.index(name) for name in character.BODIES]
    got = read.position[:, columns] / 100.0
    np.testing.assert_allclose(got, np.stack((y, z, x), -1), atol=1e-5)


def test_a_clip_of_ours_is_imported_again(tmp_path: Path) -> None:
    """The file of a walk is a motion like anybody's: units, axes and joints are recognised."""
    walk = next(c for c in load.own_clips() if c.seat is not None).part(0, 90)
    (tmp_path / "walk.bvh").write_text(bvh.text(walk))
    out = tmp_path / "clips"
    assert main(["motions", "import", str(tmp_path / "walk.bvh"), "--out", str(out)]) == 0
    (file,) = out.glob("*.npz")
    again = load.read(file)
    assert again.frames == pytest.approx(walk.frames, abs=1)
    n = min(again.frames, walk.frames)
    # retargeted: feet are made to stand still; which way it heads is the importer's own business
    paths = [c.root_position_m[:n] - c.root_position_m[0] for c in (again, walk)]
    lengths = [np.linalg.norm(path[:, :2], axis=1) for path in paths]
    assert lengths[1].max() > 0.5, "it walks"
    np.testing.assert_allclose(*lengths, atol=0.03)
    np.testing.assert_allclose(paths[0][:, 2], paths[1][:, 2], atol=0.02)


@pytest.mark.parametrize("root_motion", [False, True])
def test_a_t_pose_at_zero_and_the_same_motion(tmp_path: Path, root_motion: bool) -> None:
    path = tmp_path / "sits.bvh"
    path.write_text(bvh.text(sits(), "t-pose", root_motion))
    read = reader.read(path)
    columns = [read.names.index(name) for name in character.BODIES]
    wanted = y_up(bodies(sits())[0])
    np.testing.assert_allclose(read.position[:, columns] / 100.0, wanted, atol=1e-5)
    assert read.names[0] == ("root" if root_motion else "pelvis")
    if root_motion:
        np.testing.assert_allclose(read.position[:, 0, 1], 0.0, atol=1e-9)
        return
    # another's reader, which has no position channels below the root
    other = pybvh.read_bvh_file(path)
    np.testing.assert_allclose(other.joint_positions() / 100.0, wanted, atol=1e-5)
    rest, at = other.rest_pose_positions(), other.node_index
    arm = (rest[at["left_hand"]] - rest[at["left_upper_arm"]]) / 100.0
    np.testing.assert_allclose(arm, (0.274788 + 0.258947, 0.0, 0.0), atol=1e-5)


def test_the_root_motion_has_position_channels_on_an_offset_of_zero() -> None:
    """Programs differ in whether such channels add to the offset."""
    lines = [line.strip() for line in bvh.text(sits(), root_motion=True).splitlines()]
    at = lines.index("JOINT pelvis")
    assert lines[at + 2] == "OFFSET 0.000000 0.000000 0.000000"
    assert lines[at + 3].startswith("CHANNELS 6 Xposition Yposition Zposition Zrotation")

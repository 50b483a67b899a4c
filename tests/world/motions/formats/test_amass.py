"""AMASS files: either spelling of the rate and of the poses, and files that are none."""

from pathlib import Path

import numpy as np
import pytest

from world.errors import ClipError
from world.motions.formats import amass


def test_poses_whole_or_in_parts_are_the_same(tmp_path: Path) -> None:
    draw = np.random.default_rng(0)
    poses, trans = draw.normal(size=(4, 156)) * 0.3, draw.normal(size=(4, 3))
    np.savez(tmp_path / "a.npz", poses=poses, trans=trans, mocap_framerate=120.0)
    np.savez(
        tmp_path / "b.npz", root_orient=poses[:, :3], pose_body=poses[:, 3:66], trans=trans,
        mocap_frame_rate=60.0,
    )  # fmt: skip
    one, other = amass.read(tmp_path / "a.npz"), amass.read(tmp_path / "b.npz")
    assert (one.fps, other.fps) == (120.0, 60.0) and one.approximated
    np.testing.assert_allclose(one.position, other.position)
    np.testing.assert_allclose(one.rotation, other.rotation)
    np.testing.assert_allclose(np.diff(one.position[:, 0], axis=0), np.diff(trans, axis=0))


def test_what_is_no_motion_is_one_line(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", poses=np.zeros((4, 156)), trans=np.zeros((4, 3)))
    with pytest.raises(ClipError, match="no rate: AMASS has mocap_framerate or"):
        amass.read(tmp_path / "a.npz")
    np.savez(tmp_path / "b.npz", mocap_framerate=30, trans=np.zeros((4, 3)))
    (tmp_path / "c.npz").write_bytes(b"PK\x03\x04 torn")
    np.savez(tmp_path / "d.npz", mocap_framerate=30, trans=np.array([object()]), poses=0)
    for name in "bcd":
        with pytest.raises(
            ClipError,
            match=r"not a readable AMASS motion|an array of object; numbers and text are read",
        ) as caught:
            amass.read(tmp_path / f"{name}.npz")
        assert "\n" not in str(caught.value)

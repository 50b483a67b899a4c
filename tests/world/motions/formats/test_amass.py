"""AMASS files: either spelling of the rate and of the poses, and files that are none."""

from pathlib import Path

import numpy as np
import pytest

from world.errors import ClipError
from world.motions.formats import amass, registry


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


@pytest.mark.parametrize(
    "rate",
    [
        np.array([60.0]), np.array([[60]]), np.int16(60), np.array("60"), np.array(["60.0"]),
        np.array([b"60"]), np.full(4, 60.0), np.float32(60), np.array([60, 60], np.uint8),
    ],
)  # fmt: skip
def test_rates_of_any_shape(tmp_path: Path, rate: np.ndarray) -> None:
    np.savez(tmp_path / "a.npz", poses=np.zeros((4, 66)), trans=np.zeros((4, 3)),
             mocap_frame_rate=rate)  # fmt: skip
    assert registry.read(tmp_path / "a.npz").fps == 60.0


@pytest.mark.parametrize(
    "rate", [np.zeros(0), np.array([30.0, 60.0]), np.array("fast"), np.array(True)]
)
def test_rates_that_are_none(tmp_path: Path, rate: np.ndarray) -> None:
    np.savez(tmp_path / "a.npz", poses=np.zeros((4, 66)), trans=np.zeros((4, 3)),
             mocap_frame_rate=rate)  # fmt: skip
    with pytest.raises(ClipError, match=r"a.npz: not a readable AMASS motion"):
        registry.read(tmp_path / "a.npz")


def test_a_given_rate_replaces_one_that_is_absent(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", poses=np.zeros((4, 22, 3)), trans=np.zeros((4, 3)))
    assert registry.read(tmp_path / "a.npz", fps=50.0).fps == 50.0
    with pytest.raises(ClipError, match="--fps states the rate"):
        registry.read(tmp_path / "a.npz")


def test_a_shape_beside_motions_is_no_motion(tmp_path: Path) -> None:
    np.savez(tmp_path / "shape.npz", betas=np.zeros(16), gender="male")
    np.savez(tmp_path / "walk.npz", poses=np.zeros((4, 66)), trans=np.zeros((4, 3)), betas=0)
    np.savez(tmp_path / "other.npz", weights=np.zeros(3))
    (tmp_path / "torn.npz").write_bytes(b"PK\x03\x04")
    found = {path.stem: registry.is_companion(path) for path in tmp_path.iterdir()}
    assert found == {"shape": True, "walk": False, "other": False, "torn": False}

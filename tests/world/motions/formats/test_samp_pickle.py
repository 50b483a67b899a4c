"""SAMP's pickles: their fields, and what is missing."""

import pickle
from pathlib import Path

import numpy as np
import pytest

from world.errors import ClipError
from world.motions.formats import amass, samp_pickle


def test_the_same_poses_as_in_an_amass_file(tmp_path: Path) -> None:
    draw = np.random.default_rng(1)
    poses, trans = draw.normal(size=(3, 165)) * 0.2, draw.normal(size=(3, 3))
    held = {
        "pose_est_fullposes": poses, "pose_est_trans": trans,
        "mocap_framerate": np.array([120.0]), "other": "x",
    }  # fmt: skip
    (tmp_path / "a.pkl").write_bytes(pickle.dumps(held))
    np.savez(tmp_path / "a.npz", poses=poses, trans=trans, mocap_framerate=120.0)
    found, same = samp_pickle.read(tmp_path / "a.pkl"), amass.read(tmp_path / "a.npz")
    assert found.fps == 120.0
    np.testing.assert_allclose(found.position, same.position)


def test_what_is_missing_or_wrong_is_named(tmp_path: Path) -> None:
    path = tmp_path / "a.pkl"
    path.write_bytes(pickle.dumps({"pose_est_trans": np.zeros((3, 3))}))
    with pytest.raises(ClipError, match="no pose_est_fullposes, mocap_framerate; a SAMP motion"):
        samp_pickle.read(path)
    held = {"pose_est_fullposes": "x", "pose_est_trans": 0, "mocap_framerate": [1, 2]}
    path.write_bytes(pickle.dumps(held))
    with pytest.raises(ClipError, match="not a readable SAMP motion"):
        samp_pickle.read(path)

"""SMPL poses by hand."""

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from world.errors import ClipError
from world.motions.formats import registry, smpl


def amass(path: Path, **fields: Any) -> Path:
    np.savez(path, **fields)
    return path


def test_smpl_poses_by_hand(tmp_path: Path) -> None:
    poses = np.zeros((3, 156))
    poses[:, :3] = [np.pi / 2, 0, 0]  # y up to z up
    poses[1:, 3 * 18 : 3 * 18 + 3] = [0, -np.pi / 2, 0]  # the left elbow, forwards
    trans = np.tile([1.0, 2, 3], (3, 1))
    path = amass(
        tmp_path / "a.npz", trans=trans, poses=poses, mocap_framerate=120.0, betas=np.zeros(16),
        gender="female",
    )  # fmt: skip
    read = registry.read(path)
    at = {name: read.position[:, i] for i, name in enumerate(read.names)}
    np.testing.assert_allclose(at["Pelvis"][0], [0.998, 1.759, 3.029])
    # x to the left, y up and z ahead become x left, z up and -y ahead
    assert at["Head"][0, 2] - at["Pelvis"][0, 2] == pytest.approx(0.619)
    assert at["L_Hip"][0, 0] > at["R_Hip"][0, 0]
    forearm = at["L_Wrist"] - at["L_Elbow"]
    np.testing.assert_allclose(forearm[0], [0.267, 0.007, 0.010], atol=1e-9)
    np.testing.assert_allclose(forearm[1], [0.007, -0.267, 0.010], atol=1e-9)
    assert read.fps == 120
    assert "mean SMPL body" in read.approximated[0]
    parts = amass(
        tmp_path / "b.npz", trans=trans, root_orient=poses[:, :3], pose_body=poses[:, 3:66],
        mocap_frame_rate=120.0,
    )  # fmt: skip
    np.testing.assert_array_equal(registry.read(parts).position, read.position)
    pickled = tmp_path / "c.pkl"
    fields = {
        "pose_est_fullposes": np.pad(poses, ((0, 0), (0, 9))),
        "pose_est_trans": trans,
        "mocap_framerate": np.float64(120.0),
    }
    pickled.write_bytes(pickle.dumps(fields, protocol=2))
    np.testing.assert_array_equal(registry.read(pickled).position, read.position)


@pytest.mark.parametrize(("poses", "translations"), [(9, 8), (8, 10)])
def test_a_few_rows_more_of_either_are_left_out(poses: int, translations: int) -> None:
    travel = np.zeros((translations, 3))
    travel[:, 0] = np.arange(translations)
    found = smpl.recording(Path("a.npz"), 30.0, travel, np.zeros((poses, 66)))
    assert found.frames == 8 and np.ptp(found.position[:, 0, 0]) == pytest.approx(7.0)
    assert found.remarks[-1] == f"8 frames of {poses} poses and {translations} translations"
    with pytest.raises(ClipError, match=r"expected \[T, 66 or more\]"):
        smpl.recording(Path("a.npz"), 30.0, np.zeros((translations + 4, 3)), np.zeros((8, 66)))

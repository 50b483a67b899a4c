"""MimicKit clips are the character's own motion."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support.world.motion_files import same_motion
from world.character import model as character
from world.motions.clip import Clip
from world.motions.formats import registry


def mimickit(path: Path, clip: Clip, spread: bool) -> Path:
    """The clip as MimicKit has it, against hanging or spread arms."""
    local = Rotation.from_quat(clip.local_rotation.reshape(-1, 4), scalar_first=True)
    local = local.as_matrix().reshape(-1, 15, 3, 3)
    if spread:
        for body, side in ((3, 1.0), (6, -1.0)):
            # our arm hangs along -z, theirs points sideways
            local[:, body] = local[:, body] @ Rotation.from_euler("x", side * np.pi / 2).as_matrix()
    vector = Rotation.from_matrix(local.reshape(-1, 3, 3)).as_rotvec().reshape(-1, 15, 3)
    flexion = dict(zip((4, 7, 10, 13), clip.qpos()[:, list(character.HINGE_QPOS)].T, strict=True))
    if spread:
        flexion[7] = -flexion[7]
    columns = [clip.root_position_m, vector[:, 0]]
    for body, joint in zip(character.JOINT_BODIES, character.JOINTS, strict=True):
        columns.append(vector[:, body] if joint.is_ball else flexion[body][:, None])
    frames = np.concatenate(columns, axis=1).astype(float)
    path.write_bytes(pickle.dumps({"loop_mode": 0, "fps": clip.fps, "frames": frames.tolist()}))
    return path


@pytest.mark.parametrize("spread", [False, True])
def test_mimickit_is_the_characters_own_motion(tmp_path: Path, walking: Clip, spread: bool) -> None:
    same_motion(registry.read(mimickit(tmp_path / "m.pkl", walking, spread)), walking)

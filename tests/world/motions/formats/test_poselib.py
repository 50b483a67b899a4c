"""poselib clips: of the character's body and of another."""

from collections import OrderedDict
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support.world.motion_files import same_motion
from world.character import model as character
from world.motions.clip import Clip
from world.motions.formats import landmarks, own, registry


def poselib(path: Path, clip: Clip, is_local: bool = True, bone: float = 1.0) -> Path:
    """The clip as poselib has it: scalar last, bodies in another order."""
    order = [0, 9, 10, 11, 12, 13, 14, 1, 2, 3, 4, 5, 6, 7, 8]
    ours = own.recording(
        Path("x"), clip.fps, clip.root_position_m.astype(float), clip.local_rotation.astype(float)
    )
    turn = Rotation.from_matrix(ours.rotation[:, :15].reshape(-1, 3, 3)).as_quat()
    scalar_last = clip.local_rotation[..., [1, 2, 3, 0]] if is_local else turn.reshape(-1, 15, 4)
    parents = [-1 if p < 0 else order.index(p) for p in (character.PARENTS[b] for b in order)]
    content = OrderedDict(
        rotation={"arr": scalar_last[:, order], "context": {"dtype": "float32"}},
        root_translation={"arr": bone * clip.root_position_m, "context": {"dtype": "float32"}},
        skeleton_tree=OrderedDict(
            node_names=[character.BODIES[b] for b in order],
            parent_indices={"arr": np.array(parents), "context": {"dtype": "int64"}},
            local_translation={"arr": bone * own.offsets()[order], "context": {}},
        ),
        is_local=is_local,
        fps=clip.fps,
        __name__="SkeletonMotion",
    )
    np.save(path, content)  # pyright: ignore[reportArgumentType]
    return path


@pytest.mark.parametrize("is_local", [False, True])
def test_poselib_is_the_characters_own_motion(
    tmp_path: Path, walking: Clip, is_local: bool
) -> None:
    same_motion(registry.read(poselib(tmp_path / "p.npy", walking, is_local)), walking)


def test_poselib_of_another_body_is_a_recording(tmp_path: Path, walking: Clip) -> None:
    read = registry.read(poselib(tmp_path / "p.npy", walking, bone=1.2))
    assert not read.own_body
    joint = landmarks.find(read)
    apart = read.position[:, joint["left_knee"]] - read.position[:, joint["left_ankle"]]
    np.testing.assert_allclose(np.linalg.norm(apart, axis=-1), 1.2 * 0.40987, atol=1e-3)

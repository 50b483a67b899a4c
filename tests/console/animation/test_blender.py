"""Files as Blender reads them: joints and objects within a millimetre, and one frame drawn.

Blender is no dependency, as its package has 370 MB: `pip install bpy` into any Python, named by
INHABIT_BPY_PYTHON.
"""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from console.animation import files
from console.animation.files import Animation
from console.commands.animation import AnimationFlags
from console.recording import format as recording
from console.recording.clip import clip_of
from tests.support.console import rig_files
from tests.support.console.motions import bodies, sits, y_up
from tests.support.console.moving_takes import carried, pushed
from tests.support.paths import ROOT
from world.character import model as character

SCRIPT = ROOT / "tests" / "support" / "console" / "blender_positions.py"
PYTHON = os.environ.get("INHABIT_BPY_PYTHON") or (
    sys.executable if importlib.util.find_spec("bpy") else None
)
pytestmark = pytest.mark.skipif(
    PYTHON is None,
    reason="no Blender: install bpy, or name a Python that has it by INHABIT_BPY_PYTHON",
)


def blender(*words: object) -> str:
    assert PYTHON is not None
    done = subprocess.run([PYTHON, *map(str, words)], capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


def positions(file: Path, frames: int, *names: str, more: tuple[object, ...] = ()) -> np.ndarray:
    """Positions [frames, names, 3] m in the axes of glTF."""
    out = file.with_suffix(".blender.npz")
    blender(SCRIPT, file, out, frames, *names, *more)
    x, y, z = np.moveaxis(np.load(out)["position"], -1, 0)
    return np.stack((x, z, -y), axis=-1)


def animation(take: recording.Take) -> Animation:
    return Animation(clip_of(take, "a", "b", "c"), take, recording.model_of(take))


def test_a_glb_with_its_objects_and_a_picture(tmp_path: Path) -> None:
    take, path, picture = pushed(), tmp_path / "a.glb", tmp_path / "a.png"
    files.write(path, animation(take), AnimationFlags(root_motion=True))
    more = ("--render", picture, "--at", 20)
    got = positions(path, len(take), *character.BODIES, take.piece, more=more)
    np.testing.assert_allclose(got[:, :15], y_up(bodies(sits().part(0, len(take)))[0]), atol=1e-3)
    np.testing.assert_allclose(got[:, 15], y_up(take.mocap_pos), atol=1e-3)
    import imageio.v3 as imageio

    image = np.asarray(imageio.imread(picture))[..., :3].astype(float)
    assert image.shape[:2] == (240, 240)
    # a figure before a floor: skin, shirt and trousers differ from the grey
    colourful = np.ptp(image, axis=-1) > 30
    dark = image.max(axis=-1) < 70
    assert colourful.mean() > 0.01 and dark.mean() > 0.005


def test_a_glb_with_a_box(tmp_path: Path) -> None:
    take, path = carried(), tmp_path / "a.glb"
    files.write(path, animation(take), AnimationFlags())
    got = positions(path, len(take), "box", "target_stand")
    np.testing.assert_allclose(got[:, 0], y_up(take.qpos[:, 43:46]), atol=1e-3)
    np.testing.assert_allclose(got[:, 1], np.tile(y_up(take.stand), (len(take), 1)), atol=1e-3)


@pytest.mark.parametrize("rest", ["hanging", "t-pose"])
@pytest.mark.parametrize("root_motion", [False, True])
def test_a_bvh(tmp_path: Path, rest: str, root_motion: bool) -> None:
    path = tmp_path / "a.bvh"
    files.write(path, Animation(sits()), AnimationFlags(rest, root_motion))  # pyright: ignore
    got = positions(path, sits().frames, *character.BODIES)
    np.testing.assert_allclose(got, y_up(bodies(sits())[0]), atol=1e-3)


def test_a_rig_of_gltf(tmp_path: Path) -> None:
    """Below an armature in centimetres, with joints of any axes: the ankles are where ours are."""
    rig, path = rig_files.glb(tmp_path / "r.glb", "mixamo"), tmp_path / "a.glb"
    files.write(path, Animation(sits()), AnimationFlags(rig=rig))
    names = [f"mixamorig:Left{part}" for part in ("UpLeg", "Foot", "ForeArm", "Hand")]
    got = positions(path, sits().frames, *names)
    ours = y_up(bodies(sits())[0])
    index = [character.BODIES.index(f"left_{b}") for b in ("thigh", "foot", "lower_arm", "hand")]
    scale = np.linalg.norm(got[0, 1] - got[0, 0]) / np.linalg.norm(
        ours[0, index[1]] - ours[0, index[0]]
    )
    np.testing.assert_allclose(
        got[:, 1] - got[:, 0], scale * (ours[:, index[1]] - ours[:, index[0]]), atol=1e-3
    )
    arm, own = got[:, 3] - got[:, 2], ours[:, index[3]] - ours[:, index[2]]
    cosine = np.sum(arm * own, axis=1) / np.linalg.norm(arm, axis=1) / np.linalg.norm(own, axis=1)
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 0.1


def test_the_way_round_to_fbx(tmp_path: Path) -> None:
    """The line that a refusal of FBX gives."""
    take, glb, fbx = carried(), tmp_path / "a.glb", tmp_path / "a.fbx"
    files.write(glb, animation(take), AnimationFlags())
    blender("-c", files.blender_script(glb, fbx))
    got = positions(fbx, len(take), *character.BODIES, "box")
    from tests.support.console.motions import walk

    np.testing.assert_allclose(got[:, :15], y_up(bodies(walk().part(0, len(take)))[0]), atol=1e-3)
    np.testing.assert_allclose(got[:, 15], y_up(take.qpos[:, 43:46]), atol=1e-3)

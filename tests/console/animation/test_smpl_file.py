"""SMPL parameters: AMASS's names and shapes, frames by hand, and back through the own importer."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from console.animation import smpl_file
from tests.support.console.motions import bodies, sits, walk
from world.character import model as character
from world.motions.clip import Clip
from world.motions.formats import amass, landmarks, registry, smpl
from world.motions.retarget import body
from world.motions.retarget.convert import retargeted

INDEX = character.BODIES.index
#: Bones by the joints of SMPL at both ends, and our bodies there.
ARMS = [
    (f"{s}_Shoulder", f"{s}_Elbow", f"{side}_upper_arm", f"{side}_lower_arm")
    for s, side in (("L", "left"), ("R", "right"))
] + [
    (f"{s}_Elbow", f"{s}_Wrist", f"{side}_lower_arm", f"{side}_hand")
    for s, side in (("L", "left"), ("R", "right"))
]


def stand() -> Clip:
    """Two frames of the rest pose, arms hanging, at (1, 2, 0.88146)."""
    local = np.tile(np.array([1.0, 0, 0, 0], np.float32), (2, 15, 1))
    root = np.tile(np.array([1.0, 2.0, 0.881416], np.float32), (2, 1))
    return Clip("stand", 30, root, local, "by hand", "CC0-1.0")


def written(folder: Path, clip: Clip) -> Path:
    path = folder / f"a{smpl_file.SUFFIX}"
    path.write_bytes(smpl_file.content(clip))
    return path


def test_fields_are_those_of_amass(tmp_path: Path) -> None:
    path = written(tmp_path, walk())
    with np.load(path, allow_pickle=False) as file:
        found = dict(file)
    frames = walk().frames
    assert found["poses"].shape == (frames, 156) and found["trans"].shape == (frames, 3)
    assert found["betas"].shape == (16,) and not found["betas"].any()
    assert found["dmpls"].shape == (frames, 8)
    assert str(found["gender"]) == "neutral" and float(found["mocap_framerate"]) == 30.0
    assert not found["poses"][:, 66:].any(), "fingers are not moved"
    assert str(found["licence"]) == walk().licence
    assert registry.detected(path) == "amass"


def test_frames_by_hand() -> None:
    """Upright and facing +x with hanging arms: the root turns SMPL's y up to z up and its z ahead
    to x ahead, which is a third of a turn about (1, 1, 1); each arm hangs by a quarter turn."""
    found = smpl_file.parameters(stand())
    poses = found["poses"][0].reshape(52, 3)
    np.testing.assert_allclose(poses[0], np.full(3, 2 * np.pi / 3 / np.sqrt(3)), atol=1e-6)
    left, right = (poses[smpl.NAMES.index(f"{s}_Shoulder")] for s in "LR")
    # SMPL's arm at rest is 15 mm lower and 27 mm further back at the elbow, 258 mm out
    assert np.degrees(np.linalg.norm(left)) == pytest.approx(87, abs=2)
    assert left[2] < -1.4 and right[2] > 1.4, "about z ahead, down on both sides"
    np.testing.assert_allclose(right, left * (1, -1, -1), atol=1e-6)
    legs = [poses[smpl.NAMES.index(f"L_{part}")] for part in ("Hip", "Knee", "Ankle")]
    # the feet of the mean body point outwards by atan(38 / 126), ours ahead
    assert np.degrees(np.linalg.norm(legs, axis=1)) == pytest.approx((6.4, 10.1, 17.6), abs=0.5)
    # the root joint is above the middle of the hips by 86 mm, and 16 mm ahead of it
    legs_m = np.linalg.norm([(43, -385, 2), (-17, -423, -36)], axis=1).sum() / 1000
    scale = legs_m / body.LEG_M
    at = found["trans"][0] + smpl.ROOT_M
    np.testing.assert_allclose(at[:2], (scale * 1.0 + 0.016, scale * 2.0), atol=1e-5)


@pytest.mark.parametrize("clip", [walk(), sits()])
def test_the_own_reader_finds_the_same_pose(tmp_path: Path, clip: Clip) -> None:
    """Within 1 mm and 0.5 degrees, where the mean SMPL body has a part of ours."""
    read = amass.read(written(tmp_path, clip))
    place, turned = bodies(clip)
    joint = {name: index for index, name in enumerate(read.names)}
    scale = body.LEG_M / body._leg(read.position, landmarks.find(read))
    # the middle of the hips, and both ankles relative to it
    hips = 0.5 * (read.position[:, joint["L_Hip"]] + read.position[:, joint["R_Hip"]])
    lift = scale * hips - place[:, 0]
    assert np.abs(lift[:, :2]).max() < 1e-3 and np.ptp(lift[:, 2]) < 1e-3
    # a constant: SMPL's ankle is 8 cm above the sole, ours 5
    assert lift[0, 2] == pytest.approx(0.0324, abs=1e-3)
    for side, ours in (("L", "left"), ("R", "right")):
        leg = read.position[:, joint[f"{side}_Ankle"]] - read.position[:, joint[f"{side}_Hip"]]
        own = place[:, INDEX(f"{ours}_foot")] - place[:, INDEX(f"{ours}_thigh")]
        np.testing.assert_allclose(scale * leg, own, atol=1e-3)
    for start, end, one, other in ARMS:
        bone = read.position[:, joint[end]] - read.position[:, joint[start]]
        own = place[:, INDEX(other)] - place[:, INDEX(one)]
        cross = np.linalg.norm(np.cross(bone, own), axis=1)
        assert np.degrees(np.arctan2(cross, np.sum(bone * own, axis=1))).max() < 0.5
    # trunk and head
    upright = np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]])
    for name, own in (("Pelvis", "pelvis"), ("Spine3", "torso"), ("Head", "head")):
        away = np.swapaxes(read.rotation[:, joint[name]] @ upright.T, 1, 2) @ turned[:, INDEX(own)]
        assert np.degrees(Rotation.from_matrix(away).magnitude()).max() < 0.5


def test_the_whole_import_gives_the_motion_again(tmp_path: Path) -> None:
    """With its estimates of the body's axes, its contacts and its inverse kinematics: the path.

    The trunk of the mean SMPL body is 10 cm longer than ours, and the hands are as much higher.
    """
    again = retargeted(amass.read(written(tmp_path, walk())))
    apart = np.abs(again.root_position_m - walk().root_position_m)
    assert apart.max() < 0.03 and apart.mean() < 0.012
    ours, theirs = bodies(walk())[0], bodies(again)[0]
    for part, most in (("right_foot", 0.03), ("left_foot", 0.03), ("right_hand", 0.12)):
        assert np.linalg.norm(ours - theirs, axis=-1)[:, INDEX(part)].max() < most


def test_rotation_vectors_do_not_jump() -> None:
    turn = Rotation.from_euler("z", np.linspace(0, 4 * np.pi, 60)[:, None]).as_rotvec()
    found = smpl_file._continuous(turn)
    assert np.abs(np.diff(found, axis=0)).max() < 0.3
    again = Rotation.from_rotvec(found) * Rotation.from_rotvec(turn).inv()
    assert again.magnitude().max() < 1e-9

"""Readers of motion formats against oracles: by hand, by another library, by our own clips."""

import pickle
from collections import OrderedDict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support import foreign_motions
from tests.support.samp_clips import FOLDER
from world.character import model as character
from world.motions.clip import Clip
from world.motions.formats import acclaim, landmarks, own, registry
from world.motions.formats.recording import Recording
from world.motions.synthetic import library

SHARED = FOLDER.parent


@pytest.fixture(scope="module")
def walking() -> Clip:
    return library.walking(np.random.default_rng(0), 1.2).part(30, 60)


def same_motion(recording: Recording, clip: Clip, within_m: float = 1e-4) -> None:
    expected = own.recording(
        Path("x"), clip.fps, clip.root_position_m.astype(float), clip.local_rotation.astype(float)
    )
    np.testing.assert_allclose(recording.position, expected.position, atol=within_m)
    np.testing.assert_allclose(recording.rotation, expected.rotation, atol=20 * within_m)


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


def test_bvh_with_position_channels_everywhere(tmp_path: Path, walking: Clip) -> None:
    plain = foreign_motions.bvh_of(tmp_path / "a.bvh", walking)
    lines = plain.read_text().splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("Frame Time"))
    head = [
        line.replace("CHANNELS 3", "CHANNELS 6 Xposition Yposition Zposition")
        for line in lines[: start + 1]
    ]
    frames: list[list[str]] = []
    for line in lines[start + 1 :]:
        values = line.split()
        frames.append(values[:6])
        for joint in range(6, len(values), 3):
            frames[-1] += ["1", "2", "3", *values[joint : joint + 3]]
    other = tmp_path / "b.bvh"
    other.write_text("\n".join([*head, *(" ".join(f) for f in frames)]) + "\n")
    read = registry.read(other)
    np.testing.assert_array_equal(read.position, registry.read(plain).position)
    assert "bones keep their lengths" in read.approximated[0]


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


ASF = """:version 1.10
:name TEST
:units
  mass 1.0
  length 0.45
  angle deg
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 0 0
   orientation 0 0 0
:bonedata
  begin
     id 1
     name upper
     direction 0 1 0
     length 2
     axis 0 0 90 XYZ
    dof rx rz
  end
  begin
     id 2
     name lower
     direction 1 0 0
     length 3
     axis 0 0 0 XYZ
  end
:hierarchy
  begin
    root upper
    upper lower
  end
"""
AMC = """:FULLY-SPECIFIED
:DEGREES
1
root 1 2 3 0 0 0
upper 0 0
2
root 1 2 3 0 0 90
upper 90 0
"""


def test_acclaim_by_hand(tmp_path: Path) -> None:
    (tmp_path / "07.asf").write_text(ASF)
    path = tmp_path / "07_01.amc"
    path.write_text(AMC)
    read = registry.read(path)
    assert read.names == ("root", "upper", "lower", "lower_end")
    np.testing.assert_allclose(read.position[0], [[1, 2, 3], [1, 2, 3], [1, 4, 3], [4, 4, 3]])
    # upper turns by 90 about its own x, which its axis (90 about z) puts along the root's y; the
    # root then turns all by 90 about z: (0, 2, 0) stays (0, 2, 0) and goes to (-2, 0, 0);
    # (3, 0, 0) about y goes to (0, 0, -3), about z it stays
    np.testing.assert_allclose(read.position[1, 2], [-1, 2, 3], atol=1e-9)
    np.testing.assert_allclose(read.position[1, 3], [-1, 2, 0], atol=1e-9)


@pytest.mark.skipif(not (SHARED / "cmu").is_dir(), reason="no ../shared/motions")
def test_acclaim_of_cmu_has_cmus_proportions() -> None:
    read = registry.read(SHARED / "cmu" / "07_01.amc")
    joint = landmarks.find(read)
    leg = np.linalg.norm(
        read.position[:, joint["left_hip"]] - read.position[:, joint["left_knee"]], axis=-1
    ) + np.linalg.norm(
        read.position[:, joint["left_knee"]] - read.position[:, joint["left_ankle"]], axis=-1
    )
    # INDEX.csv, measured elsewhere: 0.809 m
    np.testing.assert_allclose(leg * 0.0254 / 0.45, 0.809, atol=0.001)
    assert read.frames == 316
    assert acclaim.beside(SHARED / "cmu" / "07_01.amc").name == "07.asf"


def test_deepmimic_is_the_characters_own_motion(tmp_path: Path, walking: Clip) -> None:
    read = registry.read(foreign_motions.deepmimic_of(tmp_path / "w.txt", walking))
    assert read.fps == pytest.approx(walking.fps)
    same_motion(read, walking, 2e-4)


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


def test_clips_are_recordings_of_themselves(tmp_path: Path, walking: Clip) -> None:
    from world.motions import clip_file

    clip_file.write(tmp_path / "c.npz", walking)
    same_motion(registry.read(tmp_path / "c.npz"), walking)


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (
            ("mixamorig:LeftUpLeg", "mixamorig:LeftLeg", "mixamorig:LeftFoot"),
            ("left", "upleg"),
        ),
        (("lfemur", "ltibia", "lfoot"), ("left", "femur")),
        (("thigh.L", "shin.L", "foot.L"), ("left", "thigh")),
        (("L_Hip", "L_Knee", "L_Ankle"), ("left", "hip")),
        (("Bip01 L Thigh", "Bip01 L Calf", "Bip01 L Foot"), ("left", "thigh")),
    ],
)
def test_names_in_use_are_known(names: tuple[str, ...], expected: tuple[str, str]) -> None:
    assert landmarks._plain(names[0]) == expected
    assert [landmarks._plain(n)[0] for n in names] == ["left"] * 3

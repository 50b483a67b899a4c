"""Motions on other skeletons: bones keep their lengths, bodies turn as ours, feet are where ours
are."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from console.animation import bvh, retarget, rig
from console.animation.retarget import Fitted, onto
from console.animation.rig import Rig, RigError
from console.animation.skeleton import Y_UP
from tests.support.console import rig_files
from tests.support.console.motions import bodies, sits, walk, y_up
from tests.support.world.rigs import RIGS
from world.character import model as character
from world.motions.clip import Clip

INDEX = character.BODIES.index


def fitted(found: Rig, clip: Clip) -> tuple[Fitted, dict[str, int]]:
    parts = found.parts(None)
    return onto(clip, found, parts), parts


def angle_deg(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angles between vectors [..., 3]."""
    cross = np.linalg.norm(np.cross(a, b), axis=-1)
    return np.degrees(np.arctan2(cross, np.sum(a * b, axis=-1)))


@pytest.mark.parametrize("kind", RIGS)
@pytest.mark.parametrize("arm_deg", [90.0, 40.0])
def test_every_rig_moves_as_the_character_does(tmp_path: Path, kind: str, arm_deg: float) -> None:
    found = rig.read(rig_files.bvh(tmp_path / "r.bvh", kind, arm_deg=arm_deg))
    clip = sits()
    made, parts = fitted(found, clip)
    position, rotation = made.skeleton.world
    ours, turned = bodies(clip)
    ours = y_up(ours)
    # bones keep their lengths
    for joint, parent in enumerate(found.parents):
        if parent >= 0:
            rest = np.linalg.norm(found.position[joint] - found.position[parent])
            now = np.linalg.norm(position[:, joint] - position[:, parent], axis=1)
            np.testing.assert_allclose(now, rest, atol=1e-6)
    hips = 0.5 * (position[:, parts["left_hip"]] + position[:, parts["right_hip"]])
    for side in ("left", "right"):
        # arms have the directions of ours
        for part, end, body, tip in (("shoulder", "elbow", "upper_arm", "lower_arm"),
                                     ("elbow", "wrist", "lower_arm", "hand")):  # fmt: skip
            bone = position[:, parts[f"{side}_{end}"]] - position[:, parts[f"{side}_{part}"]]
            own = ours[:, INDEX(f"{side}_{tip}")] - ours[:, INDEX(f"{side}_{body}")]
            assert angle_deg(bone, own).max() < 0.01
        # ankles are from the hips where ours are, at the rig's size
        leg = position[:, parts[f"{side}_ankle"]] - position[:, parts[f"{side}_hip"]]
        own = ours[:, INDEX(f"{side}_foot")] - ours[:, INDEX(f"{side}_thigh")]
        np.testing.assert_allclose(leg, made.scale * own, atol=1e-3 * made.scale)
    # standing feet are as high as at rest
    ankle = position[0, parts["left_ankle"], 1]
    own = made.scale * (ours[0, INDEX("left_foot"), 1] - 0.05)
    assert ankle == pytest.approx(found.position[parts["left_ankle"], 1] + own, abs=0.1)
    np.testing.assert_allclose(hips[:, [0, 2]], made.scale * ours[:, 0][:, [0, 2]], atol=1e-4)
    # trunk and head turn as ours
    for joint, body in ((made.hips, "pelvis"), (parts["head"], "head")):
        delta = rotation[:, joint] @ found.rotation[joint].T
        wanted = Y_UP @ turned[:, INDEX(body)] @ Y_UP.T
        apart = Rotation.from_matrix(np.swapaxes(delta, 1, 2) @ wanted).magnitude()
        assert np.degrees(apart).max() < 0.01


def test_a_leg_of_other_proportions_keeps_its_knee_ahead(tmp_path: Path) -> None:
    for thigh in (0.2, 0.3):
        found = rig.read(rig_files.bvh(tmp_path / "r.bvh", "mixamo", thigh=thigh))
        made, parts = fitted(found, sits())
        position, rotation = made.skeleton.world
        hip, knee, ankle = (position[:, parts[f"left_{p}"]] for p in ("hip", "knee", "ankle"))
        # a bent knee is on the side of the line from hip to ankle where the toes point
        away = (
            knee
            - hip
            - np.sum((knee - hip) * (ankle - hip), axis=1, keepdims=True)
            * (ankle - hip)
            / np.sum((ankle - hip) ** 2, axis=1, keepdims=True)
        )
        ahead = rotation[:, made.hips] @ (0, 0, 1.0)
        bent = np.linalg.norm(away, axis=1) > 1.0
        assert bent.any() and (np.sum(away * ahead, axis=1)[bent] > 0).all()


def test_a_rig_that_faces_another_way_is_turned(tmp_path: Path) -> None:
    """z up and facing +x, y up and facing -z: the same motion in the file's own world."""
    found = rig.read(rig_files.bvh(tmp_path / "r.bvh", "mixamo"))
    made, parts = fitted(found, walk())
    turn = Rotation.from_euler("y", 180, degrees=True).as_matrix()
    other = Rig("turned", found.names, found.parents, found.position @ turn.T, found.rotation)
    again, _ = fitted(other, walk())
    knees = [one.skeleton.world[0][:, parts["left_knee"]] for one in (again, made)]
    np.testing.assert_allclose(*knees, atol=1e-6)
    up = Rig("z up", found.names, found.parents, found.position @ Y_UP, found.rotation)
    upright, _ = fitted(up, walk())
    np.testing.assert_allclose(
        upright.skeleton.world[0] @ Y_UP.T, made.skeleton.world[0], atol=1e-6
    )


def test_spines_bend_by_degrees(tmp_path: Path) -> None:
    """Between pelvis and chest each joint turns by an equal part."""
    found = rig.read(rig_files.bvh(tmp_path / "r.bvh", "mixamo"))
    made, _ = fitted(found, sits())
    spine = [found.names.index(f"mixamorig:{n}") for n in ("Spine", "Spine1", "Spine2")]
    turns = [Rotation.from_matrix(made.skeleton.local[:, joint]).magnitude() for joint in spine]
    np.testing.assert_allclose(turns[0], turns[1], atol=1e-9)
    np.testing.assert_allclose(turns[0], turns[2], atol=1e-9)
    whole = Rotation.from_quat(sits().local_rotation[:, 1], scalar_first=True).magnitude()
    np.testing.assert_allclose(3 * turns[0], whole, atol=1e-5)


def nonsense(path: Path, frames: slice = slice(None)) -> Path:
    """A BVH of a motion whose zero pose nobody could take: each joint has axes at random."""
    found = rig.read(rig_files.bvh(path, "mixamo"))
    made, _ = fitted(found, sits())
    skeleton = made.skeleton
    turns = Rotation.random(len(found.names), random_state=3).as_matrix()
    above = np.stack([turns[p] if p >= 0 else np.eye(3) for p in found.parents])
    local = above @ skeleton.local @ np.swapaxes(turns, 1, 2)
    odd = replace(
        skeleton,
        offsets=np.einsum("jab,jb->ja", above, skeleton.offsets),
        local=local[frames],
        moves={joint: at[frames] for joint, at in skeleton.moves.items()},
    )
    path.write_text(bvh.written(odd))
    return path


def test_a_zero_pose_that_nobody_could_take_gives_way_to_a_frame(tmp_path: Path) -> None:
    """Motion capture is written so; the most upright frame of its motion is the rest."""
    found = rig.read(nonsense(tmp_path / "r.bvh"))
    parts = found.parts(None)
    chosen = retarget.standing(found, parts)
    assert chosen is not found and chosen.names == found.names
    up = chosen.position[parts["head"]] - chosen.position[parts["left_ankle"]]
    assert up[1] > 0.95 * np.linalg.norm(up)
    made = onto(sits(), found, parts)
    position, _ = made.skeleton.world
    ours = y_up(bodies(sits())[0])
    for joint, parent in enumerate(found.parents):
        if parent >= 0:
            length = np.linalg.norm(position[:, joint] - position[:, parent], axis=1)
            rest = np.linalg.norm(found.position[joint] - found.position[parent])
            np.testing.assert_allclose(length, rest, atol=1e-3)
    leg = position[:, parts["left_ankle"]] - position[:, parts["left_hip"]]
    own = ours[:, INDEX("left_foot")] - ours[:, INDEX("left_thigh")]
    np.testing.assert_allclose(leg, made.scale * own, atol=2e-3 * made.scale)
    arm = position[:, parts["left_wrist"]] - position[:, parts["left_elbow"]]
    own = ours[:, INDEX("left_hand")] - ours[:, INDEX("left_lower_arm")]
    assert angle_deg(arm, own).max() < 0.01


def test_what_never_stands_is_no_rig(tmp_path: Path) -> None:
    """Of the same file, seated frames alone."""
    found = rig.read(nonsense(tmp_path / "r.bvh", slice(-6, None)))
    with pytest.raises(RigError, match="does not stand at rest, nor in a frame") as caught:
        onto(sits(), found, found.parts(None))
    assert "\n" not in str(caught.value)

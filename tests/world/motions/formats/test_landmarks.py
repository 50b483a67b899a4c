"""Joints are found by the words of their names, and told apart by their parents."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support import foreign_motions
from tests.support.world import rigs
from world.errors import ClipError
from world.motions.clip import Clip
from world.motions.formats import landmarks

PARTS = ("hip", "knee", "ankle", "toe", "shoulder", "elbow", "wrist")


@pytest.mark.parametrize("rig", rigs.RIGS)
def test_every_part_is_found_in_each_rig(rig: str) -> None:
    tree, expected, head, sides = rigs.RIGS[rig]
    names, parents = rigs.flattened(tree)
    found = landmarks.among(names, parents, "walk")
    assert names[found["head"]] == head
    for side, spelled in zip(("right", "left"), sides, strict=True):
        for part, form in zip(PARTS, expected, strict=True):
            role = f"{side}_{part}"
            if form is None:
                assert role not in found
            else:
                assert names[found[role]] == form.format(spelled), role


@pytest.mark.parametrize("form", ["{}_jnt", "Hero_{}", "{}Joint", "a:b:{}", "b_{}", "{}.001"])
@pytest.mark.parametrize("rig", ["xsens mvn", "daz genesis 8", "rigify", "3ds max biped"])
def test_a_prefix_or_suffix_of_all_names_changes_nothing(rig: str, form: str) -> None:
    names, parents = rigs.flattened(rigs.RIGS[rig][0])
    plain = landmarks.among(names, parents, "walk")
    assert landmarks.among([form.format(name) for name in names], parents, "walk") == plain


def test_lower_and_upper_case_of_glued_names() -> None:
    names, parents = rigs.flattened(rigs.RIGS["daz genesis 8"][0])
    plain = landmarks.among(names, parents, "walk")
    for cased in (str.lower, str.upper):
        assert landmarks.among([cased(name) for name in names], parents, "walk") == plain


def test_where_the_side_is_not_understood_the_hint_names_both() -> None:
    names, parents = _person(Hips="Body", LeftUpLeg="G_UpLeg", RightUpLeg="D_UpLeg")
    with pytest.raises(ClipError, match=r"left_hip \(nearest: (D_UpLeg or G|G_UpLeg or D)_UpLeg\)"):
        landmarks.among(names, parents, "walk")


def _person(**renamed: str) -> tuple[tuple[str, ...], tuple[int, ...]]:
    names, parents = rigs.flattened(rigs.RIGS["biovision of old"][0])
    return tuple(renamed.get(name, name) for name in names), parents


def test_joints_of_equal_name_are_told_apart_by_their_parents() -> None:
    names, parents = _person(LeftHand="Hand", RightHand="Hand")
    given = {"right_wrist": "Hand", "left_wrist": "Hand"}
    for found in (
        landmarks.among(names, parents, "walk"),
        landmarks.among(names, parents, "walk", given),
        landmarks.among(names, parents, "walk", {"left_wrist": "LeftLowArm/Hand"}),
    ):
        for side in ("Left", "Right"):
            wrist = found[f"{side.lower()}_wrist"]
            assert names[parents[wrist]] == f"{side}LowArm"


def test_names_without_a_side_need_their_parents_in_the_map() -> None:
    names, parents = rigs.flattened(
        ("Hips", ("Chest", ("Head",), *(("Arm", ("Elbow", ("Hand",))) for _ in range(2))),
         *((f"{s}UpLeg", (f"{s}Leg", (f"{s}Foot",))) for s in ("Left", "Right")))
    )  # fmt: skip
    given = {
        f"{side}_{part}": name
        for side in ("left", "right")
        for part, name in (("shoulder", "Arm"), ("elbow", "Elbow"), ("wrist", "Hand"))
    }
    with pytest.raises(ClipError, match=r"2 joints have the name Arm; the map tells them apart by"):
        landmarks.among(names, parents, "walk", given)


def test_one_joint_is_not_two_parts() -> None:
    names, parents = _person()
    given = {"left_wrist": "RightHand", "right_wrist": "RightHand"}
    with pytest.raises(ClipError, match="the map gives RightHand to both left_wrist and right_"):
        landmarks.among(names, parents, "walk", given)


def test_a_hint_is_never_of_the_other_side_and_the_list_says_how_many_more() -> None:
    names, parents = _person(LeftLowLeg="LeftUnterschenkel", LeftUpLeg="LeftUpLegg")
    more = tuple(f"prop{i}" for i in range(100))
    with pytest.raises(ClipError) as caught:
        landmarks.among((*names, *more), (*parents, *(0 for _ in more)), "walk")
    text = str(caught.value)
    hints = text.split("; its joints are")[0]
    assert "left_hip (nearest: LeftUpLegg)" in hints
    assert "left_knee" in hints and "Right" not in hints
    assert f"and {len(names) + 100 - 80} more" in text


def test_a_helper_is_no_joint_of_the_body() -> None:
    names, parents = rigs.flattened(rigs.RIGS["unreal mannequin"][0])
    found = landmarks.among(names, parents, "walk")
    assert not any("ik_" in names[i] or "twist" in names[i] for i in found.values())


def test_an_end_on_its_joint_is_no_toe(walking: Clip) -> None:
    recording = foreign_motions.recorded(walking)
    toe = landmarks.find(recording)["left_toe"]
    ankle = landmarks.find(recording)["left_ankle"]
    position = recording.position.copy()
    position[:, toe] = position[:, ankle]
    assert "left_toe" not in landmarks.find(replace(recording, position=position))
    assert np.isfinite(position).all()


def test_a_map_states_rate_unit_and_axis(tmp_path: Path) -> None:
    path = tmp_path / "map.json"
    path.write_text(json.dumps({"fps": 60, "unit_m": 0.01, "up": "z", "head": "Kopf"}))
    read = landmarks.read_map(path)
    assert (read.fps, read.unit_m, read.up, read.joints) == (60.0, 0.01, "z", {"head": "Kopf"})
    for wrong, said in (
        ({"fps": 0}, "fps is a rate"),
        ({"unit_m": -1}, "unit_m is a length"),
        ({"up": "x"}, "up is y or z"),
        ({"hed": "a"}, "unknown part 'hed'"),
    ):
        path.write_text(json.dumps(wrong))
        with pytest.raises(ClipError, match=said):
            landmarks.read_map(path)

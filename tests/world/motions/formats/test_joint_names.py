"""Side and segment of joints' names."""

import pytest

from world.motions.formats.joint_names import common, meaning, rank


@pytest.mark.parametrize(
    ("name", "side", "word"),
    [
        ("mixamorig:LeftUpLeg", "left", "upleg"), ("lfemur", "left", "femur"),
        ("thigh.L", "left", "thigh"), ("L_Hip", "left", "hip"),
        ("Bip01 L Thigh", "left", "thigh"), ("rShldr", "right", "shldr"),
        ("CC_Base_R_Upperarm", "right", "upperarm"), ("upperleg01.R", "right", "upperleg"),
        ("LUArm", "left", "uarm"), ("RFArm", "right", "farm"), ("kneer", "right", "knee"),
        ("HandLeft", "left", "hand"), ("lowerarm_l", "left", "lowerarm"),
        ("Arm_Lower_L", "left", "lowerarm"), ("Leg.Upper.R", "right", "upperleg"),
        ("LeftFootToe", "left", "toe"), ("rig|LeftLeg", "left", "leg"),
        # vertebrae, helpers, tips and fingers are no joints of a limb
        ("lthighbend", "left", "thigh"), ("RFOREARMBEND", "right", "forearm"),
        ("lf_UpLeg", "left", "upleg"), ("rf_arm", "right", "arm"), ("arm_L1", "left", "arm"),
        ("Hero_L5", "", ""), ("L5Joint", "", ""), ("rthightwist", "right", ""),
        ("L5", "", ""), ("lowerleg", "", "lowerleg"), ("radius", "", "radius"),
        ("ik_foot_l", "left", ""), ("thigh_twist_01_l", "left", ""), ("HeadTop_End", "", ""),
        ("LeftHandThumb1", "left", ""), ("Bip01 HeadNub", "", ""),
    ],
)  # fmt: skip
def test_words_of_names(name: str, side: str, word: str) -> None:
    said = meaning(name)
    assert (said.side, said.word) == (side, word)


def test_the_rigs_own_words_say_nothing() -> None:
    names = ["Prop_LeftLeg", "Prop_RightLeg", "Prop_Head", "Prop_Hips"]
    assert meaning(names[0]).word == ""
    assert meaning(names[0], common(names)).word == "leg"


def test_certainty() -> None:
    assert rank("hip", "thigh") == 0 and rank("hip", "leg") == 2 and rank("hip", "hand") is None
    assert rank("knee", "leg") == 1

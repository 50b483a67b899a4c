"""Skeletons of the programs that people use: names and parents of their joints, as they write them.

Each is a tree of names in nested tuples: (name, child, child, ...).
"""

from typing import Any

Tree = tuple[Any, ...]


def chain(*names: str, ends: tuple[Tree, ...] = ()) -> Tree:
    """Joints one below the other; `ends` are below the last."""
    tree: Tree = (names[-1], *ends)
    for name in reversed(names[:-1]):
        tree = (name, tree)
    return tree


def biped(
    root: tuple[str, ...],
    spine: tuple[str, ...],
    head: tuple[str, ...],
    leg: tuple[str, ...],
    arm: tuple[str, ...],
    sides: tuple[str, str],
    hand: tuple[str, ...] = (),
    extra: tuple[Tree, ...] = (),
) -> Tree:
    """A person; names of limbs have {} for the side."""
    legs = tuple(chain(*(n.format(side) for n in leg)) for side in sides)
    fingers = tuple((n,) for n in hand)
    arms = tuple(
        chain(*(n.format(side) for n in arm), ends=tuple((f[0].format(side),) for f in fingers))
        for side in sides
    )
    trunk = chain(*spine, ends=(chain(*head), *arms, *extra))
    return chain(*root, ends=(trunk, *legs))


LR, WORDS, LOW = ("R", "L"), ("Right", "Left"), ("r", "l")
#: By program: the tree, and the names expected for hip, knee, ankle, toe, shoulder, elbow, wrist
#: (with {} for the side; toe None where there is none) and head.
RIGS: dict[str, tuple[Tree, tuple[str | None, ...], str, tuple[str, str]]] = {
    "mixamo": (
        biped(("mixamorig:Hips",), ("mixamorig:Spine", "mixamorig:Spine1", "mixamorig:Spine2"),
              ("mixamorig:Neck", "mixamorig:Head", "mixamorig:HeadTop_End"),
              ("mixamorig:{}UpLeg", "mixamorig:{}Leg", "mixamorig:{}Foot", "mixamorig:{}ToeBase",
               "mixamorig:{}Toe_End"),
              ("mixamorig:{}Shoulder", "mixamorig:{}Arm", "mixamorig:{}ForeArm",
               "mixamorig:{}Hand"), WORDS,
              ("mixamorig:{}HandThumb1", "mixamorig:{}HandIndex1")),
        ("mixamorig:{}UpLeg", "mixamorig:{}Leg", "mixamorig:{}Foot", "mixamorig:{}ToeBase",
         "mixamorig:{}Arm", "mixamorig:{}ForeArm", "mixamorig:{}Hand"), "mixamorig:Head", WORDS),
    "daz genesis 8": (
        biped(("hip", "pelvis"), ("abdomenLower", "abdomenUpper", "chestLower", "chestUpper"),
              ("neckLower", "neckUpper", "head", "upperJaw"),
              ("{}ThighBend", "{}ThighTwist", "{}Shin", "{}Foot", "{}Metatarsals", "{}Toe",
               "{}BigToe"),
              ("{}Collar", "{}ShldrBend", "{}ShldrTwist", "{}ForearmBend", "{}ForearmTwist",
               "{}Hand"), LOW, ("{}Thumb1", "{}Carpal1")),
        ("{}ThighBend", "{}Shin", "{}Foot", "{}Toe", "{}ShldrBend", "{}ForearmBend", "{}Hand"),
        "head", LOW),
    "daz genesis 9": (
        biped(("hip", "pelvis"), ("spine1", "spine2", "spine3", "spine4"),
              ("neck1", "neck2", "head"),
              ("{}_thigh", "{}_shin", "{}_foot", "{}_metatarsal", "{}_toes", "{}_bigtoe1"),
              ("{}_shoulder", "{}_upperarm", "{}_forearm", "{}_hand"), LOW,
              ("{}_thumb1", "{}_indexmetacarpal")),
        ("{}_thigh", "{}_shin", "{}_foot", "{}_toes", "{}_upperarm", "{}_forearm", "{}_hand"),
        "head", LOW),
    "poser and mocapnet": (
        biped(("hip",), ("abdomen", "chest"), ("neck", "neck1", "head", "__jaw", "jaw"),
              ("{}Buttock", "{}Thigh", "{}Shin", "{}Foot", "toe1-1.{}", "toe1-2.{}"),
              ("{}Collar", "{}Shldr", "{}ForeArm", "{}Hand"), LOW,
              ("{}Thumb1", "metacarpal1.{}")),
        ("{}Thigh", "{}Shin", "{}Foot", "toe1-1.{}", "{}Shldr", "{}ForeArm", "{}Hand"), "head",
        LOW),
    "makehuman": (
        biped(("root",), ("spine05", "spine04", "spine03", "spine02", "spine01"),
              ("neck01", "neck02", "neck03", "head", "jaw"),
              ("pelvis.{}", "upperleg01.{}", "upperleg02.{}", "lowerleg01.{}", "lowerleg02.{}",
               "foot.{}", "toe1-1.{}", "toe1-2.{}"),
              ("clavicle.{}", "shoulder01.{}", "upperarm01.{}", "upperarm02.{}", "lowerarm01.{}",
               "lowerarm02.{}", "wrist.{}"), LR, ("finger1-1.{}", "metacarpal1.{}")),
        ("upperleg01.{}", "lowerleg01.{}", "foot.{}", "toe1-1.{}", "upperarm01.{}",
         "lowerarm01.{}", "wrist.{}"), "head", LR),
    "biovision": (
        biped(("Hips",), ("Chest",), ("Neck", "Head"),
              ("{}Hip", "{}Knee", "{}Ankle"),
              ("{}Collar", "{}Shoulder", "{}Elbow", "{}Wrist"), WORDS),
        ("{}Hip", "{}Knee", "{}Ankle", None, "{}Shoulder", "{}Elbow", "{}Wrist"), "Head", WORDS),
    "biovision of old": (
        biped(("Hips",), ("Chest", "Chest2"), ("Neck", "Head"),
              ("{}UpLeg", "{}LowLeg", "{}Foot"),
              ("{}Collar", "{}UpArm", "{}LowArm", "{}Hand"), WORDS),
        ("{}UpLeg", "{}LowLeg", "{}Foot", None, "{}UpArm", "{}LowArm", "{}Hand"), "Head", WORDS),
    "3ds max biped": (
        biped(("Bip01", "Bip01 Pelvis"), ("Bip01 Spine", "Bip01 Spine1"),
              ("Bip01 Neck", "Bip01 Head", "Bip01 HeadNub"),
              ("Bip01 {} Thigh", "Bip01 {} Calf", "Bip01 {} Foot", "Bip01 {} Toe0",
               "Bip01 {} Toe0Nub"),
              ("Bip01 {} Clavicle", "Bip01 {} UpperArm", "Bip01 {} Forearm", "Bip01 {} Hand"), LR,
              ("Bip01 {} Finger0",)),
        ("Bip01 {} Thigh", "Bip01 {} Calf", "Bip01 {} Foot", "Bip01 {} Toe0", "Bip01 {} UpperArm",
         "Bip01 {} Forearm", "Bip01 {} Hand"), "Bip01 Head", LR),
    "3ds max biped with underlines": (
        biped(("Bip001", "Bip001_Pelvis"), ("Bip001_Spine",), ("Bip001_Neck", "Bip001_Head"),
              ("Bip001_{}_Thigh", "Bip001_{}_Calf", "Bip001_{}_Foot", "Bip001_{}_Toe0"),
              ("Bip001_{}_Clavicle", "Bip001_{}_UpperArm", "Bip001_{}_Forearm", "Bip001_{}_Hand"),
              LR, ("Bip001_{}_Finger0",)),
        ("Bip001_{}_Thigh", "Bip001_{}_Calf", "Bip001_{}_Foot", "Bip001_{}_Toe0",
         "Bip001_{}_UpperArm", "Bip001_{}_Forearm", "Bip001_{}_Hand"), "Bip001_Head", LR),
    "reallusion": (
        biped(("RL_BoneRoot", "CC_Base_Hip", "CC_Base_Pelvis"),
              ("CC_Base_Waist", "CC_Base_Spine01", "CC_Base_Spine02"),
              ("CC_Base_NeckTwist01", "CC_Base_NeckTwist02", "CC_Base_Head", "CC_Base_JawRoot"),
              ("CC_Base_{}_Thigh", "CC_Base_{}_Calf", "CC_Base_{}_Foot", "CC_Base_{}_ToeBase",
               "CC_Base_{}_BigToe1"),
              ("CC_Base_{}_Clavicle", "CC_Base_{}_Upperarm", "CC_Base_{}_Forearm",
               "CC_Base_{}_Hand"), LR, ("CC_Base_{}_Thumb1", "CC_Base_{}_Index1")),
        ("CC_Base_{}_Thigh", "CC_Base_{}_Calf", "CC_Base_{}_Foot", "CC_Base_{}_ToeBase",
         "CC_Base_{}_Upperarm", "CC_Base_{}_Forearm", "CC_Base_{}_Hand"), "CC_Base_Head", LR),
    "vroid": (
        biped(("Root", "J_Bip_C_Hips"), ("J_Bip_C_Spine", "J_Bip_C_Chest", "J_Bip_C_UpperChest"),
              ("J_Bip_C_Neck", "J_Bip_C_Head", "J_Adj_L_FaceEye"),
              ("J_Bip_{}_UpperLeg", "J_Bip_{}_LowerLeg", "J_Bip_{}_Foot", "J_Bip_{}_ToeBase"),
              ("J_Bip_{}_Shoulder", "J_Bip_{}_UpperArm", "J_Bip_{}_LowerArm", "J_Bip_{}_Hand"),
              LR, ("J_Bip_{}_Index1",), extra=(("J_Sec_L_Bust1",), ("J_Sec_Hair1_01",))),
        ("J_Bip_{}_UpperLeg", "J_Bip_{}_LowerLeg", "J_Bip_{}_Foot", "J_Bip_{}_ToeBase",
         "J_Bip_{}_UpperArm", "J_Bip_{}_LowerArm", "J_Bip_{}_Hand"), "J_Bip_C_Head", LR),
    "vrm": (
        biped(("hips",), ("spine", "chest", "upperChest"), ("neck", "head"),
              ("{}UpperLeg", "{}LowerLeg", "{}Foot", "{}Toes"),
              ("{}Shoulder", "{}UpperArm", "{}LowerArm", "{}Hand"), ("right", "left")),
        ("{}UpperLeg", "{}LowerLeg", "{}Foot", "{}Toes", "{}UpperArm", "{}LowerArm", "{}Hand"),
        "head", ("right", "left")),
    "rokoko": (
        biped(("Root", "Hips"), ("Spine1", "Spine2", "Spine3", "Spine4"), ("Neck", "Head"),
              ("{}Thigh", "{}Shin", "{}Foot", "{}Toe", "{}ToeTip"),
              ("{}Shoulder", "{}Arm", "{}ForeArm", "{}Hand"), WORDS, ("{}Finger1Metacarpal",)),
        ("{}Thigh", "{}Shin", "{}Foot", "{}Toe", "{}Arm", "{}ForeArm", "{}Hand"), "Head", WORDS),
    "xsens": (
        biped(("Hips",), ("Chest", "Chest2", "Chest3", "Chest4"), ("Neck", "Head"),
              ("{}Hip", "{}Knee", "{}Ankle", "{}Toe"),
              ("{}Collar", "{}Shoulder", "{}Elbow", "{}Wrist"), WORDS),
        ("{}Hip", "{}Knee", "{}Ankle", "{}Toe", "{}Shoulder", "{}Elbow", "{}Wrist"), "Head",
        WORDS),
    "xsens mvn": (
        biped(("Pelvis",), ("L5", "L3", "T12", "T8"), ("Neck", "Head"),
              ("{}UpperLeg", "{}LowerLeg", "{}Foot", "{}Toe"),
              ("{}Shoulder", "{}UpperArm", "{}ForeArm", "{}Hand"), WORDS),
        ("{}UpperLeg", "{}LowerLeg", "{}Foot", "{}Toe", "{}UpperArm", "{}ForeArm", "{}Hand"),
        "Head", WORDS),
    "unreal mannequin": (
        biped(("root", "pelvis"), ("spine_01", "spine_02", "spine_03"), ("neck_01", "head"),
              ("thigh_{}", "calf_{}", "foot_{}", "ball_{}"),
              ("clavicle_{}", "upperarm_{}", "lowerarm_{}", "hand_{}"), LOW,
              ("thumb_01_{}", "lowerarm_twist_01_{}"),
              extra=(("ik_foot_l",), ("ik_hand_gun", ("ik_hand_l",)))),
        ("thigh_{}", "calf_{}", "foot_{}", "ball_{}", "upperarm_{}", "lowerarm_{}", "hand_{}"),
        "head", LOW),
    "rigify": (
        biped(("spine",), ("spine.001", "spine.002", "spine.003"),
              ("spine.004", "spine.005", "spine.006", "face"),
              ("thigh.{}", "shin.{}", "foot.{}", "toe.{}"),
              ("shoulder.{}", "upper_arm.{}", "forearm.{}", "hand.{}"), LR,
              ("palm.01.{}", "thumb.01.{}"), extra=(("breast.L",), ("breast.R",))),
        ("thigh.{}", "shin.{}", "foot.{}", "toe.{}", "upper_arm.{}", "forearm.{}", "hand.{}"),
        "spine.006", LR),
    "rigify's deforming bones": (
        biped(("root", "DEF-spine"), ("DEF-spine.001", "DEF-spine.002", "DEF-spine.003"),
              ("DEF-spine.004", "DEF-spine.005", "DEF-spine.006"),
              ("DEF-thigh.{}", "DEF-thigh.{}.001", "DEF-shin.{}", "DEF-shin.{}.001", "DEF-foot.{}",
               "DEF-toe.{}"),
              ("DEF-shoulder.{}", "DEF-upper_arm.{}", "DEF-upper_arm.{}.001", "DEF-forearm.{}",
               "DEF-forearm.{}.001", "DEF-hand.{}"), LR, ("DEF-thumb.01.{}",)),
        ("DEF-thigh.{}", "DEF-shin.{}", "DEF-foot.{}", "DEF-toe.{}", "DEF-upper_arm.{}",
         "DEF-forearm.{}", "DEF-hand.{}"), "DEF-spine.006", LR),
    "smpl": (
        biped(("Pelvis",), ("Spine1", "Spine2", "Spine3"), ("Neck", "Head"),
              ("{}_Hip", "{}_Knee", "{}_Ankle", "{}_Foot"),
              ("{}_Collar", "{}_Shoulder", "{}_Elbow", "{}_Wrist", "{}_Hand"), LR),
        ("{}_Hip", "{}_Knee", "{}_Ankle", "{}_Foot", "{}_Shoulder", "{}_Elbow", "{}_Wrist"),
        "Head", LR),
    "smpl in unity": (
        biped(("m_avg_root", "m_avg_Pelvis"), ("m_avg_Spine1", "m_avg_Spine2", "m_avg_Spine3"),
              ("m_avg_Neck", "m_avg_Head"),
              ("m_avg_{}_Hip", "m_avg_{}_Knee", "m_avg_{}_Ankle", "m_avg_{}_Foot"),
              ("m_avg_{}_Collar", "m_avg_{}_Shoulder", "m_avg_{}_Elbow", "m_avg_{}_Wrist",
               "m_avg_{}_Hand"), LR),
        ("m_avg_{}_Hip", "m_avg_{}_Knee", "m_avg_{}_Ankle", "m_avg_{}_Foot", "m_avg_{}_Shoulder",
         "m_avg_{}_Elbow", "m_avg_{}_Wrist"), "m_avg_Head", LR),
    "smpl-x": (
        biped(("pelvis",), ("spine1", "spine2", "spine3"), ("neck", "head", "jaw"),
              ("{}_hip", "{}_knee", "{}_ankle", "{}_foot"),
              ("{}_collar", "{}_shoulder", "{}_elbow", "{}_wrist"), ("right", "left"),
              ("{}_index1", "{}_thumb1")),
        ("{}_hip", "{}_knee", "{}_ankle", "{}_foot", "{}_shoulder", "{}_elbow", "{}_wrist"),
        "head", ("right", "left")),
    "motive": (
        biped(("Skeleton:Hip",), ("Skeleton:Ab", "Skeleton:Chest"),
              ("Skeleton:Neck", "Skeleton:Head"),
              ("Skeleton:{}Thigh", "Skeleton:{}Shin", "Skeleton:{}Foot", "Skeleton:{}Toe"),
              ("Skeleton:{}Shoulder", "Skeleton:{}UArm", "Skeleton:{}FArm", "Skeleton:{}Hand"),
              LR),
        ("Skeleton:{}Thigh", "Skeleton:{}Shin", "Skeleton:{}Foot", "Skeleton:{}Toe",
         "Skeleton:{}UArm", "Skeleton:{}FArm", "Skeleton:{}Hand"), "Skeleton:Head", LR),
    "cgspeed": (
        biped(("Hips",), ("LowerBack", "Spine", "Spine1"), ("Neck", "Neck1", "Head"),
              ("{}HipJoint", "{}UpLeg", "{}Leg", "{}Foot", "{}ToeBase"),
              ("{}Shoulder", "{}Arm", "{}ForeArm", "{}Hand"), WORDS, ("{}FingerBase", "{}Thumb")),
        ("{}UpLeg", "{}Leg", "{}Foot", "{}ToeBase", "{}Arm", "{}ForeArm", "{}Hand"), "Head",
        WORDS),
    "acclaim": (
        biped(("root",), ("lowerback", "upperback", "thorax"),
              ("lowerneck", "upperneck", "head"),
              ("{}hipjoint", "{}femur", "{}tibia", "{}foot", "{}toes"),
              ("{}clavicle", "{}humerus", "{}radius", "{}wrist", "{}hand", "{}fingers"), LOW),
        ("{}femur", "{}tibia", "{}foot", "{}toes", "{}humerus", "{}radius", "{}wrist"), "head",
        LOW),
    "kinect": (
        biped(("SpineBase",), ("SpineMid", "SpineShoulder"), ("Neck", "Head"),
              ("Hip{}", "Knee{}", "Ankle{}", "Foot{}"),
              ("Shoulder{}", "Elbow{}", "Wrist{}", "Hand{}", "HandTip{}"), WORDS, ("Thumb{}",)),
        ("Hip{}", "Knee{}", "Ankle{}", "Foot{}", "Shoulder{}", "Elbow{}", "Wrist{}"), "Head",
        WORDS),
    "auto-rig pro": (
        biped(("root.x",), ("spine_01.x", "spine_02.x"), ("neck.x", "head.x"),
              ("thigh_stretch.{}", "leg_stretch.{}", "foot.{}", "toes_01.{}"),
              ("shoulder.{}", "arm_stretch.{}", "forearm_stretch.{}", "hand.{}"), LOW,
              ("index1.{}",)),
        ("thigh_stretch.{}", "leg_stretch.{}", "foot.{}", "toes_01.{}", "arm_stretch.{}",
         "forearm_stretch.{}", "hand.{}"), "head.x", LOW),
    "a hip above the thigh": (
        biped(("pelvis",), ("spine",), ("neck", "head"),
              ("hip_{}", "bind_skin_thigh_{}", "shin_{}", "foot_{}"),
              ("shoulder_{}", "bind_skin_upperarm_{}", "forearm_{}", "hand_{}"), LR),
        ("bind_skin_thigh_{}", "shin_{}", "foot_{}", None, "bind_skin_upperarm_{}", "forearm_{}",
         "hand_{}"), "head", LR),
    "unreal 5 with correctives": (
        biped(("root", "pelvis"), ("spine_01", "spine_05"), ("neck_01", "neck_02", "head"),
              ("thigh_{}", "calf_{}", "foot_{}", "ball_{}"),
              ("clavicle_{}", "upperarm_{}", "lowerarm_{}", "hand_{}"), LOW,
              ("wrist_inner_{}", "wrist_outer_{}", "index_metacarpal_{}", "weapon_{}"),
              (("thigh_correctiveRoot_l",), ("ankle_bck_l",), ("calf_kneeBack_r",))),
        ("thigh_{}", "calf_{}", "foot_{}", "ball_{}", "upperarm_{}", "lowerarm_{}", "hand_{}"),
        "head", LOW),
    "second life": (
        biped(("mPelvis",), ("mTorso", "mChest"), ("mNeck", "mHead"),
              ("mHip{}", "mKnee{}", "mAnkle{}", "mFoot{}", "mToe{}"),
              ("mCollar{}", "mShoulder{}", "mElbow{}", "mWrist{}"), WORDS),
        ("mHip{}", "mKnee{}", "mAnkle{}", "mToe{}", "mShoulder{}", "mElbow{}", "mWrist{}"),
        "mHead", WORDS),
    "lower case throughout": (
        biped(("hip",), ("abdomen",), ("head",), ("{}hip", "{}knee", "{}foot"),
              ("{}shoulder", "{}elbow", "{}hand"), LOW),
        ("{}hip", "{}knee", "{}foot", None, "{}shoulder", "{}elbow", "{}hand"), "head", LOW),
}  # fmt: skip


def flattened(tree: Tree) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Names and parents of a tree's joints, parents first."""
    names: list[str] = []
    parents: list[int] = []

    def add(node: Tree, parent: int) -> None:
        here = len(names)
        names.append(node[0])
        parents.append(parent)
        for child in node[1:]:
            add(child, here)

    add(tree, -1)
    return tuple(names), tuple(parents)

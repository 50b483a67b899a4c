"""Rules by which a joint's name tells the part of the body: side, limb and segment.

A name is cut into words at case, digits and signs; words that say nothing (a prefix of the rig, a
number) are passed over. So one rule covers `mixamorig:LeftUpLeg`, `CC_Base_L_Thigh`, `J_Bip_L_
UpperLeg`, `Bip01 L Thigh`, `rThigh`, `lfemur`, `DEF-thigh.L` and `upperleg01.L`.
"""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

#: Words for the segment that begins at each part, the most certain first. The last of `hip` and
#: `knee` share `leg`, those of `shoulder` share `shoulder` with collar bones: parents decide.
SEGMENTS: dict[str, tuple[tuple[str, ...], ...]] = {
    "hip": (
        ("upleg", "upperleg", "uleg", "thigh", "femur"),
        ("hip", "hips", "hipjoint"),
        ("leg",),
    ),
    "knee": (
        ("knee", "lowerleg", "lowleg", "loleg", "foreleg", "shin", "shank", "calf",
         "tibia"),
        ("leg",),
    ),
    "ankle": (("ankle", "talus"), ("foot",)),
    "toe": (
        ("toebase", "toes", "toe", "ball"),
        ("foot",),
    ),
    "shoulder": (
        ("upperarm", "uparm", "uarm", "humerus", "shldr"),
        ("arm",),
        ("shoulder",),
    ),
    "elbow": (
        ("elbow", "forearm", "farm", "lowerarm", "lowarm", "loarm", "radius", "ulna"),
    ),
    "wrist": (("wrist",), ("hand", "palm")),
    "head": (("head", "skull"), ("upperneck",), ("neck",)),
}  # fmt: skip
_WORDS = frozenset(word for groups in SEGMENTS.values() for group in groups for word in group)
_LONGEST = 3
"""Greatest number of parts of a word."""
_COMMON = 0.7
"""Fraction of the names beyond which a word is the rig's."""
#: Other words that a single lower-case word may hold behind its side.
_SIDED_ALONE = _WORDS | {"clavicle", "collar", "buttock", "eye", "thumb"}
#: A joint with one of these is a helper of the rig, a tip, a finger, or something held.
_HELPERS = frozenset((
    "twist", "twst", "roll", "ik", "fk", "pole", "target", "goal", "ctrl", "control", "controller",
    "end", "nub", "tip", "site", "top", "helper", "share", "sharebone", "corrective", "weapon",
    "prop", "socket", "attach", "holder", "marker", "mesh", "geo", "thumb", "index", "middle",
    "mid", "ring", "pinky", "pinkie", "little", "finger", "fingers", "metacarpal", "carpal",
    "tongue", "eye", "eyes", "jaw", "hair", "breast", "brow", "lip", "teeth", "sec", "skirt",
    "bust", "rib", "ribs", "big", "tweak", "mch", "org", "vis", "mechanism", "pivot", "offset",
    "heel", "virtual", "aim", "dummy", "null", "locator", "pad", "swing", "orient", "back", "bck",
    "fwd", "ponytail",
))  # fmt: skip
_LIMBS, _WHICH = ("arm", "leg"), ("upper", "up", "lower", "low", "lo", "fore")
_SIDES = {
    "l": "left", "left": "left", "lft": "left", "lt": "left", "lf": "left",
    "r": "right", "right": "right", "rgt": "right", "rt": "right", "rf": "right",
}  # fmt: skip
#: Words behind a segment's, without a sign between in names of lower case: lthighbend.
_TAILS = ("bend", "twist", "roll", "joint", "bone", "jnt", "end", "nub", "base")
_VERTEBRA = re.compile(r"(?:(?<![A-Za-z])[LlRr]|(?<=[a-z])[LR])\d+(?![a-z])")
_CUT = re.compile(r"[A-Z]+(?![a-z])|[A-Z][a-z]+|[a-z]+|\d+|[^\W\d_a-zA-Z]+")


@dataclass(frozen=True)
class Meaning:
    """What a joint's name says."""

    side: str
    """right, left or empty."""
    word: str
    """The segment's word; empty where the name has none, or is a helper's."""
    others: int = 0
    """Number of words that say neither side nor segment."""


def common(names: Sequence[str]) -> frozenset[str]:
    """The words of nearly all names, such as the name of the rig: they tell no joint apart."""
    counts = Counter(word for name in names for word in set(_words(name)))
    return frozenset(word for word, count in counts.items() if count > _COMMON * len(names))


def meaning(name: str, ignored: frozenset[str] = frozenset()) -> Meaning:
    """The meaning of a joint's name; the words in `ignored` say nothing."""
    words = [word for word in _words(name) if word not in ignored]
    side, rest = "", []
    for word in words:
        if word in _SIDES:
            side = _SIDES[word]
        else:
            rest.append(word)
    if any(word in _HELPERS for word in rest):
        return Meaning(side, "")
    for place in range(len(rest) - 1):
        if rest[place] in _LIMBS and rest[place + 1] in _WHICH:
            rest[place : place + 2] = [rest[place + 1], rest[place]]  # Arm_Lower_L
    found, used = "", 0
    # the last segment counts: 'LeftFootToe' is a toe, 'hip_thigh' a thigh
    for start in range(len(rest)):
        for count in range(min(_LONGEST, len(rest) - start), 0, -1):
            joined = "".join(rest[start : start + count])
            if joined in _WORDS and not (found.endswith(joined) and used > count):
                found, used = joined, count
                break
    if not found and _VERTEBRA.search(name):
        side = ""  # Hips_L5 and L5_joint are on neither
    numbers = sum(word.isdigit() for word in rest)
    return Meaning(side, found, len(rest) - used - numbers if found else 0)


def rank(part: str, word: str) -> int | None:
    """How certainly a segment's word names a part, 0 the most; None where it does not."""
    for level, group in enumerate(SEGMENTS[part]):
        if word in group:
            return level
    return None


def _words(name: str) -> list[str]:
    """The words of a name in lower case, without the namespace; a glued side is cut off."""
    plain = re.split(r"[:|]", name)[-1]
    found: list[str] = []
    if re.fullmatch(r"[A-Za-z]\d+", plain):
        return [plain.lower()]  # a vertebra: L5 is not on the left
    for piece in _CUT.findall(plain):
        low = piece.lower()
        if piece.isupper() and len(low) == 2 and low[0] in "lr" and low[1] in "uf":
            found += [low[0], low[1]]  # LUArm, RFArm
        elif low in _SIDES or low in _SIDED_ALONE or low in _HELPERS:
            found.append(low)
        else:
            found += _unglued(low)
    return found


def _unglued(word: str) -> list[str]:
    """A word, cut where a side begins or ends it: lfemur, leftupleg, kneer."""
    for side in ("left", "right", "l", "r"):
        if word.startswith(side) and word[len(side) :] in _SIDED_ALONE:
            return [side, word[len(side) :]]
        if word.endswith(side) and word[: -len(side)] in _SIDED_ALONE:
            return [side, word[: -len(side)]]
        for tail in _TAILS:
            middle = word[len(side) : -len(tail)]
            if word.startswith(side) and word.endswith(tail) and middle in _SIDED_ALONE:
                return [side, middle, tail]
    return [word]

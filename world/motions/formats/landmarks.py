"""Assignment of a recording's joints to parts of the body, by their names or by a map file."""

import difflib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from world.errors import ClipError
from world.motions.formats.recording import Recording

SIDES = ("right", "left")
#: Names of each part without their side, the most certain first: MotionBuilder and Mixamo, Acclaim,
#: SMPL, the humanoids of reinforcement learning, Rigify.
_SIDED = {
    "hip": ("upleg", "upperleg", "thigh", "femur", "hip"),
    "knee": ("knee", "lowerleg", "loleg", "shin", "calf", "tibia", "leg"),
    "ankle": ("ankle", "foot"),
    "toe": ("toebase", "toes", "toe", "ball", "foot", "toebaseend", "footend"),
    "shoulder": ("arm", "upperarm", "uparm", "humerus", "shoulder"),
    "elbow": ("elbow", "forearm", "lowerarm", "loarm", "radius"),
    "wrist": ("wrist", "hand"),
}
_MIDDLE = {"head": ("head", "skull", "upperneck", "neck")}
#: Parts that retargeting requires.
REQUIRED = (
    "head",
    *(f"{side}_{part}" for part in _SIDED if part != "toe" for side in SIDES),
)
ROLES = (*REQUIRED, "left_toe", "right_toe")
_UNIT, _UP = "unit_m", "up"


@dataclass(frozen=True)
class Map:
    """Content of a `--map` file: what cannot be inferred from names and sizes."""

    joints: Mapping[str, str] = field(default_factory=dict)
    """Joint names by part of the body, e.g. left_knee: LeftLeg."""
    unit_m: float | None = None
    """Length unit of the file, m."""
    up: str | None = None
    """The file's upward axis, y or z."""


def read_map(path: Path) -> Map:
    """Read a map file: JSON with joint names by part of the body, and optionally `unit_m` and
    `up`."""
    try:
        content = json.loads(path.read_text())
    except (OSError, ValueError, RecursionError) as error:
        raise ClipError(f"{path}: not a readable map file ({error})") from error
    if not isinstance(content, dict):
        raise ClipError(f'{path}: a map file is an object such as {{"left_knee": "LeftLeg"}}')
    valid = (*ROLES, _UNIT, _UP)
    for key, value in content.items():
        if key not in valid:
            raise ClipError(f"{path}: unknown part '{key}': choose from {', '.join(valid)}")
        _checked(path, key, value)
    joints = {key: value for key, value in content.items() if key in ROLES}
    unit = content.get(_UNIT)
    return Map(joints, None if unit is None else float(unit), content.get(_UP))


def _checked(path: Path, key: str, value: Any) -> None:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if key == _UNIT and not (number and value > 0):
        raise ClipError(f"{path}: unit_m is a length in metres above 0, is {value!r}")
    if key == _UP and value not in ("y", "z"):
        raise ClipError(f"{path}: up is y or z, is {value!r}")
    if key in ROLES and not isinstance(value, str):
        raise ClipError(f"{path}: {key} names a joint, is {value!r}")


def find(recording: Recording, given: Mapping[str, str] | None = None) -> dict[str, int]:
    """Index of the joint of each part of the body in a recording; see `among`."""
    return among(recording.names, recording.name, given)


def among(
    names: Sequence[str], whose: str, given: Mapping[str, str] | None = None
) -> dict[str, int]:
    """Index of the joint of each part of the body, by a known name or by `given`.

    Raises ClipError, which begins with `whose` and lists the parts that are not found; toes are
    optional.
    """
    given = given or {}
    plain = [_plain(name) for name in names]
    found: dict[str, int] = {}
    for role in ROLES:
        if role in given:
            if given[role] not in names:
                raise ClipError(
                    f"{whose}: the map names '{given[role]}' as {role}, which is none of its"
                    f" joints: {_listed(names)}"
                )
            found[role] = list(names).index(given[role])
            continue
        # the joint of the ankle cannot be that of the toes too
        taken = set(found.values())
        for alias in _aliases(role):
            wanted = (role.rpartition("_")[0], alias)
            match = next((i for i, p in enumerate(plain) if p == wanted and i not in taken), None)
            if match is not None:
                found[role] = match
                break
    missing = [role for role in REQUIRED if role not in found]
    if missing:
        free = [name for i, name in enumerate(names) if i not in found.values()]
        raise ClipError(_complaint(names, free, whose, missing))
    return found


def _aliases(role: str) -> tuple[str, ...]:
    side, _, part = role.rpartition("_")
    return _SIDED[part] if side else _MIDDLE[part]


def _complaint(
    names: Sequence[str], free: Sequence[str], whose: str, missing: Sequence[str]
) -> str:
    hints = [f"{role} (nearest: {_nearest(role, free)})" for role in missing]
    return (
        f"{whose}: no joint found for {', '.join(hints)}; its joints are {_listed(names)}; name"
        " them in a --map file"
    )


def _nearest(role: str, names: Sequence[str]) -> str:
    """The name that is most similar to one of a part's names."""
    side = role.rpartition("_")[0]
    likeness = {
        name: max(
            difflib.SequenceMatcher(None, f"{side}{alias}", "".join(_plain(name))).ratio()
            for alias in _aliases(role)
        )
        for name in names
        if not name.endswith("_end")
    }
    best = max(likeness, key=lambda name: likeness[name], default="")
    return best if best and likeness[best] > 0.5 else "none alike"


def _listed(names: Sequence[str]) -> str:
    shown = [name for name in names if not name.endswith("_end")][:60]
    return ", ".join(shown)


def _plain(name: str) -> tuple[str, str]:
    """Side (right, left or empty) and the rest of a joint's name, in lower case."""
    text = name.rsplit(":", 1)[-1]
    text = re.sub(r"^(mixamorig\d*|bip0?1|def|b)[_\- ]+", "", text, flags=re.IGNORECASE)
    patterns = (
        (r"^(right|left)[_\-. ]*(.+)$", 1, 2),
        (r"^(.+?)[_\-. ]*(right|left)$", 2, 1),
        (r"^([rl])[_\-. ]+(.+)$", 1, 2),
        (r"^(.+?)[_\-. ]+([rl])$", 2, 1),
        (r"^([RL])([A-Z].+)$", 1, 2),
    )
    side, rest = "", text
    for pattern, at_side, at_rest in patterns:
        flags = 0 if pattern.startswith("^([RL])") else re.IGNORECASE
        match = re.match(pattern, text, flags)
        if match:
            side = {"r": "right", "l": "left"}[match.group(at_side)[0].lower()]
            rest = match.group(at_rest)
            break
    else:
        # Acclaim joins the side to the bone: lfemur, rtibia
        match = re.match(
            r"^([rl])(femur|tibia|foot|toes|humerus|radius|wrist|hand|hipjoint|clavicle)$", text
        )
        if match:
            side, rest = {"r": "right", "l": "left"}[match.group(1)], match.group(2)
    return side, re.sub(r"[^a-z0-9]", "", rest.lower())

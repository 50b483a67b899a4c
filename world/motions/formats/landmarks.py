"""Assignment of a recording's joints to parts of the body, by their names or by a map file."""

import difflib
import itertools
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from world.errors import ClipError
from world.motions.formats import joint_names
from world.motions.formats.recording import RATES_HZ, Recording
from world.placeholders import read_bounded
from world.refusals import reason

SIDES = ("right", "left")
_LEG, _ARM = ("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist")
#: Parts that retargeting requires.
REQUIRED = (
    "head",
    *(f"{side}_{part}" for part in (*_LEG, *_ARM) for side in SIDES),
)
ROLES = (*REQUIRED, "left_toe", "right_toe")
#: Cost of a joint per word of its name that says nothing, relative to a step of certainty.
_PER_WORD = 1.5
#: Candidates of a part that are tried in chains.
_MOST = 12
MAX_MAP_BYTES = 1 << 20
_SHOWN = 80
"""Greatest number of joints that a message lists."""
#: Toes nearer to the ankle than this fraction of the legs are none.
_NO_TOE = 0.02
_TIED = 0.05
"""Likeness of names, of 1, within which neither is the nearer."""
_UNIT, _UP, _FPS = "unit_m", "up", "fps"
#: Length units by their names, m.
UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}


@dataclass(frozen=True)
class Map:
    """What cannot be inferred from names and sizes: content of a `--map` file and of flags."""

    joints: Mapping[str, str] = field(default_factory=dict)
    """Joint names by part of the body, e.g. left_knee: LeftLeg."""
    unit_m: float | None = None
    """Length unit of the file, m."""
    up: str | None = None
    """The file's upward axis, y or z."""
    fps: float | None = None
    """Frames per second of the file, in place of what it states."""


def read_map(path: Path) -> Map:
    """Read a map file: JSON with joint names by part of the body, and optionally `unit_m`, `up` and
    `fps`."""
    try:
        content = json.loads(read_bounded(path, MAX_MAP_BYTES))
    except (OSError, ValueError, RecursionError) as error:
        raise ClipError(f"{path}: not a readable map file ({reason(error)})") from error
    if not isinstance(content, dict):
        raise ClipError(f'{path}: a map file is an object such as {{"left_knee": "LeftLeg"}}')
    valid = (*ROLES, _UNIT, _UP, _FPS)
    for key, value in content.items():
        if key not in valid:
            raise ClipError(f"{path}: unknown part '{key}': choose from {', '.join(valid)}")
        _checked(path, key, value)
    joints = {key: value for key, value in content.items() if key in ROLES}
    unit, fps = content.get(_UNIT), content.get(_FPS)
    return Map(
        joints,
        None if unit is None else float(unit),
        content.get(_UP),
        None if fps is None else float(fps),
    )


def _checked(path: Path, key: str, value: Any) -> None:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if key == _UNIT and not (number and 1e-6 <= value <= 1e3):
        raise ClipError(f"{path}: unit_m is a length in metres above 0, is {value!r}")
    low, high = RATES_HZ
    if key == _FPS and not (number and low <= value <= high):
        raise ClipError(f"{path}: fps is a rate from {low:g} to {high:g}, is {value!r}")
    if key == _UP and value not in ("y", "z"):
        raise ClipError(f"{path}: up is y or z, is {value!r}")
    if key in ROLES and not isinstance(value, str):
        raise ClipError(f"{path}: {key} names a joint, is {value!r}")


def find(recording: Recording, given: Mapping[str, str] | None = None) -> dict[str, int]:
    """Index of the joint of each part of the body in a recording; see `among`."""
    found = among(recording.names, recording.parents, recording.name, given)
    position = recording.position
    for side in SIDES:
        toe = found.get(f"{side}_toe")
        if toe is None:
            continue
        ankle, knee = (position[:, found[f"{side}_{part}"]] for part in ("ankle", "knee"))
        foot = np.linalg.norm(position[:, toe] - ankle, axis=-1)
        # an end site may lie on its joint
        if np.median(foot) < _NO_TOE * np.median(np.linalg.norm(ankle - knee, axis=-1)):
            del found[f"{side}_toe"]
    return found


def among(
    names: Sequence[str],
    parents: Sequence[int],
    whose: str,
    given: Mapping[str, str] | None = None,
) -> dict[str, int]:
    """Index of the joint of each part of the body, by the words of its name or by `given`.

    Joints of a limb descend from one another, which tells equal names and equal words apart.
    Raises ClipError, which begins with `whose` and lists the parts that are not found; toes are
    optional.
    """
    tree = _Tree(names, parents, whose, given or {})
    found: dict[str, int] = {}
    for side in SIDES:
        for limb in (_LEG, _ARM):
            found |= tree.limb(side, limb)
    for side in SIDES:
        toe = tree.toe(side, found)
        if toe is not None:
            found[f"{side}_toe"] = toe
    head = tree.head(found)
    if head is not None:
        found["head"] = head
    missing = [role for role in REQUIRED if role not in found]
    if missing:
        raise ClipError(tree.complaint(missing, set(found.values())))
    return {role: found[role] for role in ROLES if role in found}


class _Tree:
    """The joints of a skeleton with what their names mean."""

    def __init__(
        self, names: Sequence[str], parents: Sequence[int], whose: str, given: Mapping[str, str]
    ) -> None:
        self._names, self._whose = names, whose
        ends = [name.endswith("_end") for name in names]
        ignored = joint_names.common([n for n, end in zip(names, ends, strict=True) if not end])
        self._meaning = [joint_names.meaning(name, ignored) for name in names]
        self._above: list[tuple[int, ...]] = []
        """Ancestors of each joint, the nearest first."""
        for parent in parents:
            self._above.append((parent, *self._above[parent]) if parent >= 0 else ())
        self._flat = max(map(len, self._above), default=0) < len(_LEG) - 1
        self._side = [self._sided(index) for index in range(len(names))]
        self._given = {role: self._named(role, name) for role, name in given.items()}
        for one, other in itertools.combinations(sorted(self._given), 2):
            if self._given[one] == self._given[other] and len(self._given[one]) == 1:
                raise ClipError(
                    f"{whose}: the map gives {given[one]} to both {one} and {other}; each part has"
                    " a joint of its own"
                )

    def _sided(self, joint: int) -> str:
        """The side of a joint's name, or of its nearest ancestor with one."""
        sides = (self._meaning[index].side for index in (joint, *self._above[joint]))
        return next((side for side in sides if side), "")

    def _named(self, role: str, name: str) -> list[int]:
        """The joints that a map names for a part; several where their names are equal."""
        found = [index for index, other in enumerate(self._names) if other == name]
        if not found and "/" in name:
            path = name.strip("/").split("/")
            found = [i for i in range(len(self._names)) if self._path(i)[-len(path) :] == path]
        if not found:
            raise ClipError(
                f"{self._whose}: the map names '{name}' as {role}, which is none of its joints:"
                f" {self._listed(self._names)}"
            )
        side = role.rpartition("_")[0]
        return [index for index in found if self._side[index] == side] or found

    def _path(self, joint: int) -> list[str]:
        return [self._names[index] for index in (*reversed(self._above[joint]), joint)]

    def _candidates(self, side: str, part: str) -> list[tuple[float, int]]:
        """Joints of a part with their costs, the least first."""
        role = f"{side}_{part}" if side else part
        if role in self._given:
            return [(0.0, index) for index in self._given[role]]
        taken = {found[0] for found in self._given.values() if len(found) == 1}
        found = []
        for index, said in enumerate(self._meaning):
            level = joint_names.rank(part, said.word) if said.word else None
            if level is None or index in taken or self._side[index] != side:
                continue
            found.append((level + _PER_WORD * said.others, index))
        return sorted(found, key=lambda one: (one[0], len(self._above[one[1]])))[:_MOST]

    def limb(self, side: str, parts: Sequence[str]) -> dict[str, int]:
        """The joints of a limb, each below the one before; only those found where not all are."""
        options = [self._candidates(side, part) for part in parts]
        best: tuple[tuple[float, int], tuple[int, ...]] | None = None
        for chain in itertools.product(*options):
            joints = tuple(index for _, index in chain)
            if len(set(joints)) < len(joints) or not self._descends(side, parts, joints):
                continue
            cost = sum(c for c, _ in chain), sum(len(self._above[i]) for i in joints)
            if best is None or cost < best[0]:
                best = cost, joints
        if best is not None:
            chain = (self._first(side, parts[0], best[1], options[0]), *best[1][1:])
            self._unambiguous(side, parts, chain)
            return {f"{side}_{p}": i for p, i in zip(parts, chain, strict=True)}
        # a map's own faults are said by the caller
        given = [self._given.get(f"{side}_{part}", []) for part in parts]
        if all(given):
            return {f"{side}_{p}": own[0] for p, own in zip(parts, given, strict=True)}
        found: dict[str, int] = {}
        for part, option in zip(parts, options, strict=True):
            free = [index for _, index in option if index not in found.values()]
            if free:
                found[f"{side}_{part}"] = free[0]
        if len(found) == len(parts):
            names = ", ".join(self._names[index] for index in found.values())
            raise ClipError(
                f"{self._whose}: {names} look like {', '.join(found)} and do not descend from one"
                " another; name the joints in a --map file"
            )
        return found

    def _first(
        self, side: str, part: str, chain: Sequence[int], options: Sequence[tuple[float, int]]
    ) -> int:
        """The first joint of a limb: a shoulder above an upper arm is a collar bone, a hip above a
        thigh belongs to the pelvis, whatever other words their names have."""
        first, second = chain[:2]
        if f"{side}_{part}" in self._given:
            return first

        def level(joint: int) -> int:
            return joint_names.rank(part, self._meaning[joint].word) or 0

        between = self._above[second][: self._above[second].index(first)] if not self._flat else ()
        below = [index for _, index in options if index in between and level(index) < level(first)]
        return min(below, key=level, default=first)

    def _descends(self, side: str, parts: Sequence[str], joints: Sequence[int]) -> bool:
        """Whether each joint is below the one before; joints of a map need not be."""
        if self._flat:
            return True
        pairs = zip(zip(parts, joints, strict=True), list(zip(parts, joints, strict=True))[1:],
                    strict=False)  # fmt: skip
        for (above, upper), (below, lower) in pairs:
            free = f"{side}_{above}" not in self._given or f"{side}_{below}" not in self._given
            several = len(self._given.get(f"{side}_{below}", ())) > 1
            if (free or several) and upper not in self._above[lower]:
                return False
        return True

    def _unambiguous(self, side: str, parts: Sequence[str], joints: Sequence[int]) -> None:
        """Raise ClipError where a map's name fits several joints below the same one."""
        for place, (part, joint) in enumerate(zip(parts, joints, strict=True)):
            above = joints[place - 1] if place else -1
            twins = [
                other
                for other in self._given.get(f"{side}_{part}", ())
                if above < 0 or above in self._above[other]
            ]
            if len(twins) > 1:
                paths = " or ".join("/".join(self._path(one)[-2:]) for one in twins[:4])
                raise ClipError(
                    f"{self._whose}: {len(twins)} joints have the name {self._names[joint]}; the"
                    f" map tells them apart by their parents: {paths}"
                )

    def toe(self, side: str, found: Mapping[str, int]) -> int | None:
        """The toes, below the ankle; an end of the foot where there are none."""
        ankle = found.get(f"{side}_ankle")
        options = [index for _, index in self._candidates(side, "toe")]
        if f"{side}_toe" in self._given:
            below = [index for index in options if ankle in self._above[index]]
            return (below or options)[0]
        if ankle is None:
            return None
        options = [i for i in options if i != ankle and (self._flat or ankle in self._above[i])]
        ends = [
            index
            for index, above in enumerate(self._above)
            if above[:1] == (ankle,) and self._names[index].lower().endswith(("end", "nub"))
        ]
        return next(iter((*options, *ends)), None)

    def head(self, found: Mapping[str, int]) -> int | None:
        """The head: by its name, else the end of the spine above the shoulders, else the neck."""
        options = self._candidates("", "head")
        sure = [index for cost, index in options if cost < 1 or "head" in self._given]
        if sure:
            return sure[0]
        shoulders = [found.get(f"{side}_shoulder") for side in SIDES]
        if None not in shoulders and not self._flat:
            right, left = (self._above[joint] for joint in shoulders if joint is not None)
            chest = next((index for index in left if index in right), None)
            top = self._top(chest) if chest is not None else None
            if top is not None:
                return top
        named = [index for _, index in options]
        return named[0] if named else None

    def _top(self, chest: int) -> int | None:
        """The last joint of the longest chain without side or limb above the chest."""
        best: tuple[int, int] | None = None
        spine = _stem(self._names[chest])
        for index, above in enumerate(self._above):
            if chest not in above or self._names[index].lower().endswith(("end", "nub")):
                continue
            chain = (index, *above[: above.index(chest)])
            if all(_stem(self._names[one]) == spine for one in chain):
                best = max(best or (0, 0), (len(chain), index))
        return best[1] if best else None

    def complaint(self, missing: Sequence[str], taken: set[int]) -> str:
        """The message on parts that are not found."""
        free = [index for index in range(len(self._names)) if index not in taken]
        hints = [f"{role} (nearest: {self._nearest(role, free)})" for role in missing]
        return (
            f"{self._whose}: no joint found for {', '.join(hints)}; its joints are"
            f" {self._listed(self._names)}; name them in a --map file"
        )

    def _nearest(self, role: str, free: Sequence[int]) -> str:
        """The joint on the part's side, or on none, whose name is most like one of the part's."""
        side, _, part = role.rpartition("_")
        likeness: dict[int, float] = {}
        for index in free:
            if self._side[index] not in ("", side) or self._names[index].endswith("_end"):
                continue
            plain = re.sub(r"[\W\d_]", "", self._names[index].lower())
            own = side if self._side[index] else ""
            likeness[index] = max(
                difflib.SequenceMatcher(None, f"{own}{word}", plain).ratio()
                for group in joint_names.SEGMENTS[part]
                for word in group
            )
        for own in (side, ""):
            alike = {i: value for i, value in likeness.items() if self._side[i] == own}
            best = max(alike.values(), default=0.0)
            if best > 0.6:
                # two names without a side that is understood may be of either: D_Leg and G_Leg
                near = sorted(
                    (i for i, value in alike.items() if value > best - _TIED),
                    key=lambda index: -alike[index],
                )
                shown = near[:1] if own or not side else near[:2]
                return " or ".join(dict.fromkeys(self._names[index] for index in shown))
        return "none alike"

    @staticmethod
    def _listed(names: Sequence[str]) -> str:
        own = [name for name in names if not name.endswith("_end")]
        more = f" and {len(own) - _SHOWN} more" if len(own) > _SHOWN else ""
        return ", ".join(own[:_SHOWN]) + more


def _stem(name: str) -> str:
    """A name without its numbers and signs: spine.003 and spine.004 have one stem."""
    return re.sub(r"[\W\d_]", "", name.lower())

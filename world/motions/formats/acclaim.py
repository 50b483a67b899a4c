"""Reader of Acclaim motions: an `.amc` file and the `.asf` skeleton that lies beside it.

The parsers on PyPI require an order of keywords that CMU's files do not have; the format is small.
Source: J. Lander, "Working with motion capture file formats" (1998): a bone's rotation in the world
is its parent's times C M inverse(C), C being its `axis`, M its degrees of freedom.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from world.errors import ClipError
from world.motions.formats.recording import Recording, forward
from world.motions.licences import licence

SUFFIXES = (".amc",)
#: CMU's rate; AMC files do not state theirs.
RATE_HZ = 120.0
_DOFS = ("rx", "ry", "rz")


@dataclass(frozen=True)
class Bone:
    """One bone of an ASF skeleton."""

    name: str
    along: np.ndarray
    """[3]: from start to end at the zero pose, in the file's unit."""
    axis: np.ndarray
    """[3, 3]: frame of its rotations."""
    order: str
    """Axes in the order of application, such as xyz."""
    dof: tuple[str, ...]


@dataclass(frozen=True)
class Skeleton:
    """An ASF skeleton: bones and parents by name."""

    root_order: tuple[str, ...]
    root_axis: str
    degrees: bool
    bones: dict[str, Bone]
    parents: dict[str, str]


def read(path: Path) -> Recording:
    """The motion in an AMC file with the skeleton beside it. Raises ClipError."""
    skeleton_path = beside(path)
    try:
        skeleton = _skeleton(skeleton_path.read_text(errors="replace"))
    except (OSError, ValueError, IndexError, KeyError) as error:
        raise ClipError(f"{skeleton_path}: not a readable ASF skeleton ({error})") from error
    try:
        frames = list(_frames(path.read_text(errors="replace"), skeleton))
    except (OSError, ValueError, IndexError, KeyError) as error:
        raise ClipError(f"{path}: not a readable AMC motion ({error})") from error
    if not frames:
        raise ClipError(f"{path}: 0 frames; a transition needs at least 2")
    values = {
        bone: np.array([frame[bone] for frame in frames], dtype=np.float64) for bone in frames[0]
    }
    names, parents, offset, local = _pose(skeleton, values, len(frames))
    place = [skeleton.root_order.index(f"t{axis}") for axis in "xyz"]
    position, rotation = forward(parents, offset, local, values["root"][:, place])
    return Recording(
        name=path.stem,
        fps=RATE_HZ,
        names=names,
        parents=parents,
        position=position,
        rotation=rotation,
        source=path.name,
        licence=licence(path.parent),
        approximated=(f"{RATE_HZ:g} frames a second: AMC does not say",),
    )


def beside(path: Path) -> Path:
    """The skeleton file of an AMC file: of its own name, of its subject's, or the only one
    there."""
    folder = path.parent
    found = {p.stem.lower(): p for p in folder.iterdir() if p.suffix.lower() == ".asf"}
    for stem in (path.stem, path.stem.split("_")[0]):
        if stem.lower() in found:
            return found[stem.lower()]
    if len(found) == 1:
        return next(iter(found.values()))
    there = ", ".join(sorted(p.name for p in found.values())) or "none"
    raise ClipError(f"{path}: no skeleton {path.stem.split('_')[0]}.asf beside it (found: {there})")


def _skeleton(text: str) -> Skeleton:
    parts = _sections(text)
    for needed in ("root", "bonedata", "hierarchy"):
        if needed not in parts:
            raise ValueError(f"no :{needed}")
    root = {words[0].lower(): words[1:] for words in parts["root"] if words}
    degrees = not any(words[:2] == ["angle", "rad"] for words in parts.get("units", []))
    bones: dict[str, Bone] = {}
    for block in _blocks(parts["bonedata"]):
        bone = _bone(block, degrees)
        bones[bone.name] = bone
    parents: dict[str, str] = {}
    for block in _blocks(parts["hierarchy"]):
        for words in block:
            for child in words[1:]:
                parents[child] = words[0]
    lost = [name for name in (*parents, *parents.values()) if name not in bones and name != "root"]
    if lost:
        raise ValueError(f"the hierarchy names {lost[0]}, which is no bone")
    return Skeleton(
        tuple(word.lower() for word in root["order"]),
        root.get("axis", ["XYZ"])[0].lower(),
        degrees,
        bones,
        parents,
    )


def _sections(text: str) -> dict[str, list[list[str]]]:
    parts: dict[str, list[list[str]]] = {}
    name = ""
    for line in text.splitlines():
        line = line.split("#")[0].strip()
        if line.startswith(":"):
            words = line[1:].split()
            name = words[0].lower()
            parts[name] = [words[1:]] if len(words) > 1 else []
        elif line and name:
            parts[name].append(line.split())
    return parts


def _blocks(lines: list[list[str]]) -> Iterator[list[list[str]]]:
    block: list[list[str]] | None = None
    for words in lines:
        if words[0].lower() == "begin":
            block = []
        elif words[0].lower() == "end" and block is not None:
            yield block
            block = None
        elif block is not None:
            block.append(words)
    if block is not None:
        raise ValueError("a block has no end: the file is cut short")


def _bone(block: list[list[str]], degrees: bool) -> Bone:
    fields = {words[0].lower(): words[1:] for words in block}
    direction = np.array([float(w) for w in fields["direction"][:3]])
    angles = [float(w) for w in fields["axis"][:3]]
    order = (fields["axis"][3] if len(fields["axis"]) > 3 else "XYZ").lower()
    return Bone(
        name=fields["name"][0],
        along=direction * float(fields["length"][0]),
        # lower case: about fixed axes, the first letter first
        axis=Rotation.from_euler(order, angles, degrees=degrees).as_matrix(),
        order=order,
        dof=tuple(word.lower() for word in fields.get("dof", []) if word.lower() in _DOFS),
    )


def _frames(text: str, skeleton: Skeleton) -> Iterator[dict[str, list[float]]]:
    """Values by bone of each frame; ValueError where a frame lacks a bone or a value."""
    width = {name: len(bone.dof) for name, bone in skeleton.bones.items() if bone.dof}
    width["root"] = len(skeleton.root_order)
    frame: dict[str, list[float]] = {}
    number, started = "", False
    for line in text.splitlines():
        words = line.split()
        if not words or words[0][0] in "#:":
            continue
        if len(words) == 1 and re.fullmatch(r"\d+", words[0]):
            if started:
                yield _whole(frame, width, number)
            frame, number, started = {}, words[0], True
            continue
        if words[0] not in width:
            raise ValueError(f"frame {number} moves {words[0]}, which is no bone of the skeleton")
        frame[words[0]] = [float(word) for word in words[1:]]
    if started:
        yield _whole(frame, width, number)


def _whole(
    frame: dict[str, list[float]], width: dict[str, int], number: str
) -> dict[str, list[float]]:
    for bone, count in width.items():
        if len(frame.get(bone, ())) != count:
            raise ValueError(
                f"frame {number} has {len(frame.get(bone, ()))} values of {bone}, not {count}:"
                " the file is cut short"
            )
    return frame


def _pose(
    skeleton: Skeleton, values: dict[str, np.ndarray], frames: int
) -> tuple[tuple[str, ...], tuple[int, ...], np.ndarray, np.ndarray]:
    """Joint names, parents, offsets [J, 3] and local rotations [T, J, 3, 3]: one joint at the start
    of each bone, and one at each open end."""
    names, parents, offsets = ["root"], [-1], [np.zeros(3)]
    turn = [skeleton.root_order.index(f"r{axis}") for axis in skeleton.root_axis]
    local = [
        Rotation.from_euler(
            skeleton.root_axis, values["root"][:, turn], degrees=skeleton.degrees
        ).as_matrix()
    ]
    children: dict[str, list[str]] = {}
    for child, parent in skeleton.parents.items():
        children.setdefault(parent, []).append(child)
    still = np.tile(np.eye(3), (frames, 1, 1))

    def add(name: str, parent: int, offset: np.ndarray) -> None:
        bone = skeleton.bones[name]
        here = len(names)
        names.append(name)
        parents.append(parent)
        offsets.append(offset)
        local.append(_turned(bone, values.get(name), skeleton.degrees, still))
        for child in children.get(name, ()):
            add(child, here, bone.along)
        if name not in children:
            names.append(f"{name}_end")
            parents.append(here)
            offsets.append(bone.along)
            local.append(still)

    for child in children.get("root", ()):
        add(child, 0, np.zeros(3))
    return tuple(names), tuple(parents), np.array(offsets), np.stack(local, axis=1)


def _turned(bone: Bone, values: np.ndarray | None, degrees: bool, still: np.ndarray) -> np.ndarray:
    """A bone's rotations [T, 3, 3] relative to its parent."""
    if values is None or not bone.dof:
        return still
    angles = np.zeros((len(still), 3))
    for column, dof in enumerate(bone.dof):
        angles[:, bone.order.index(dof[1])] = values[:, column]
    motion = Rotation.from_euler(bone.order, angles, degrees=degrees).as_matrix()
    return bone.axis @ motion @ bone.axis.T

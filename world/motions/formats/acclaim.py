"""Reader of Acclaim motions: an `.amc` file and the `.asf` skeleton that lies beside it.

The parsers on PyPI require an order of keywords that CMU's files do not have; the format is small.
Source: J. Lander, "Working with motion capture file formats" (1998): a bone's rotation in the world
is its parent's times C M inverse(C), C being its `axis`, M its degrees of freedom. Translations of
a bone are along the axes of C; `l` lengthens it.
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
from world.motions.text import decoded
from world.placeholders import placeholder

SUFFIXES = (".amc",)
RATE_HZ = 120.0
"""CMU's rate, for AMC files that do not state theirs."""
_DOFS = ("rx", "ry", "rz", "tx", "ty", "tz", "l")
#: Keywords of an AMC file's rate, and of its angles.
_RATES = ("samples-per-second", "frames-per-second", "samplespersecond", "fps", "rate")
_ANGLES = {"degrees": True, "deg": True, "radians": False, "rad": False}
#: Acclaim's unit: its `length` is the file's units in an inch.
_INCH_M = 0.0254


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
    root_position: tuple[float, float, float]
    degrees: bool
    """Unit of its own angles, and of the motion's unless the motion states one."""
    unit_m: float | None
    """Stated length unit, m."""
    bones: dict[str, Bone]
    parents: dict[str, str]


@dataclass(frozen=True)
class Header:
    """What an AMC file states before its frames; None where it does not."""

    fps: float | None
    degrees: bool | None


def read(path: Path) -> Recording:
    """The motion in an AMC file with the skeleton beside it. Raises ClipError."""
    skeleton_path = beside(path)
    try:
        skeleton = _skeleton(decoded(skeleton_path.read_bytes()))
    except (OSError, ValueError, IndexError, KeyError) as error:
        raise ClipError(
            f"{path}: its skeleton {skeleton_path} is not a readable ASF file"
            f" ({placeholder(skeleton_path) or error})"
        ) from error
    try:
        text = decoded(path.read_bytes())
        header = _header(text)
        unmoved: set[str] = set()
        frames = list(_frames(text, skeleton, unmoved))
    except (OSError, ValueError, IndexError, KeyError) as error:
        raise ClipError(f"{path}: not a readable AMC motion ({error})") from error
    if not frames:
        raise ClipError(f"{path}: 0 frames; a transition needs at least 2")
    values = {
        bone: np.array([frame[bone] for frame in frames], dtype=np.float64) for bone in frames[0]
    }
    degrees = skeleton.degrees if header.degrees is None else header.degrees
    names, parents, offset, local = _pose(skeleton, values, len(frames), degrees)
    position, rotation = forward(parents, offset, local, _root(skeleton, values["root"]))
    remarks: list[str] = []
    if unmoved:
        listed = ", ".join(sorted(unmoved))
        remarks.append(f"values of bones without dof in the skeleton are left out: {listed}")
    return Recording(
        name=path.stem,
        fps=header.fps or RATE_HZ,
        names=names,
        parents=parents,
        position=position,
        rotation=rotation,
        source=path.name,
        licence=licence(path),
        likely_unit_m=skeleton.unit_m,
        fps_assumed=header.fps is None,
        approximated=tuple(remarks),
    )


def _root(skeleton: Skeleton, values: np.ndarray) -> np.ndarray:
    """Positions [T, 3] of the root; where an axis does not move, the skeleton's."""
    position = np.tile(np.array(skeleton.root_position), (len(values), 1))
    for axis, letter in enumerate("xyz"):
        if f"t{letter}" in skeleton.root_order:
            position[:, axis] = values[:, skeleton.root_order.index(f"t{letter}")]
    return position


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
    units = {words[0].lower(): words[1] for words in parts.get("units", []) if len(words) > 1}
    degrees = not units.get("angle", "deg").lower().startswith("rad")
    length = float(units.get("length", "0"))
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
        (*(float(word) for word in root.get("position", ["0", "0", "0"])[:3]),),  # pyright: ignore
        degrees,
        _INCH_M / length if length > 0 else None,
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


def _header(text: str) -> Header:
    """What an AMC file states before its first frame."""
    fps: float | None = None
    degrees: bool | None = None
    for line in text.splitlines():
        words = line.replace("=", " ").split()
        if not words or words[0][0] == "#":
            continue
        if words[0][0] != ":":
            break
        key = words[0][1:].lower().replace("_", "-").rstrip(":")
        if key in _ANGLES:
            degrees = _ANGLES[key]
        elif key in _RATES:
            if len(words) < 2 or not float(words[1]) > 0:
                raise ValueError(f"{words[0]} states no rate above 0")
            fps = float(words[1])
    return Header(fps, degrees)


def _frames(text: str, skeleton: Skeleton, unmoved: set[str]) -> Iterator[dict[str, list[float]]]:
    """Values by bone of each frame; ValueError where a frame lacks a bone or a value.

    Rows of bones without freedom, which some programs write, move nothing; `unmoved` collects
    those that are not 0.
    """
    width = {name: len(bone.dof) for name, bone in skeleton.bones.items() if bone.dof}
    width["root"] = len(skeleton.root_order)
    still = {name for name, bone in skeleton.bones.items() if not bone.dof}
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
        if words[0] in still:
            if any(float(word) for word in words[1:]):
                unmoved.add(words[0])
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
    skeleton: Skeleton, values: dict[str, np.ndarray], frames: int, degrees: bool
) -> tuple[tuple[str, ...], tuple[int, ...], np.ndarray, np.ndarray]:
    """Joint names, parents, offsets [T, J, 3] and local rotations [T, J, 3, 3]: one joint at the
    start of each bone, and one at each open end."""
    none = np.zeros((frames, 3))
    names, parents, offsets = ["root"], [-1], [none]
    turned = np.zeros((frames, 3))
    for column, axis in enumerate(skeleton.root_axis):
        if f"r{axis}" in skeleton.root_order:
            turned[:, column] = values["root"][:, skeleton.root_order.index(f"r{axis}")]
    local = [Rotation.from_euler(skeleton.root_axis, turned, degrees=degrees).as_matrix()]
    children: dict[str, list[str]] = {}
    for child, parent in skeleton.parents.items():
        children.setdefault(parent, []).append(child)
    still = np.tile(np.eye(3), (frames, 1, 1))

    def add(name: str, parent: int, offset: np.ndarray) -> None:
        bone = skeleton.bones[name]
        turned, moved, along = _moved(bone, values.get(name), degrees, still)
        here = len(names)
        names.append(name)
        parents.append(parent)
        offsets.append(offset + moved)
        local.append(turned)
        for child in children.get(name, ()):
            add(child, here, along)
        if name not in children:
            names.append(f"{name}_end")
            parents.append(here)
            offsets.append(along)
            local.append(still)

    for child in children.get("root", ()):
        add(child, 0, none)
    return tuple(names), tuple(parents), np.stack(offsets, axis=1), np.stack(local, axis=1)


def _moved(
    bone: Bone, values: np.ndarray | None, degrees: bool, still: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A bone's rotations [T, 3, 3], and the shifts of its start and from its start to its end
    [T, 3], relative to its parent."""
    angles, shift = np.zeros((len(still), 3)), np.zeros((len(still), 3))
    along = np.tile(bone.along, (len(still), 1))
    if values is None or not bone.dof:
        return still, shift, along
    for column, dof in enumerate(bone.dof):
        if dof == "l":
            length = max(float(np.linalg.norm(bone.along)), 1e-12)
            along = along + values[:, column, None] * bone.along / length
        elif dof[0] == "t":
            shift[:, "xyz".index(dof[1])] = values[:, column]
        else:
            angles[:, bone.order.index(dof[1])] = values[:, column]
    motion = Rotation.from_euler(bone.order, angles, degrees=degrees).as_matrix()
    return bone.axis @ motion @ bone.axis.T, shift @ bone.axis.T, along

"""Reader of Acclaim motions: an `.amc` file and the `.asf` skeleton that lies beside it.

The parsers on PyPI require an order of keywords that CMU's files do not have; the format is small.
Source: J. Lander, "Working with motion capture file formats" (1998): a bone's rotation in the world
is its parent's times C M inverse(C), C being its `axis`, M its degrees of freedom. Translations of
a bone are along the axes of C; `l` lengthens it.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from world.errors import ClipError
from world.motions import gaps
from world.motions.formats.recording import Recording, forward
from world.motions.licences import licence
from world.motions.text import Names, decoded, lines, with_points
from world.placeholders import placeholder
from world.refusals import reason

SUFFIXES = (".amc",)
RATE_HZ = 120.0
"""CMU's rate, for AMC files that do not state theirs."""
_DOFS = ("rx", "ry", "rz", "tx", "ty", "tz", "l")
#: Keywords of an AMC file's rate, without signs: SAMPLES-PER-SECOND.
_RATES = frozenset((
    "samplespersecond", "framespersecond", "fps", "rate", "framerate", "samplerate",
    "samplingrate",
))  # fmt: skip
_DURATION = "frametime"
_HEADER = re.compile(
    r":\s*(?P<key>[A-Za-z][A-Za-z _-]*?)(?:[\s:=]+(?P<number>[-+]?[\d.]\S*)(?:\s.*)?)?[\s:]*"
)
_ANGLES = re.compile(r"(?:angles?|angleunits?|units?)?(deg|rad)(?:s|rees?|ians?)?")
MAX_BONES = 2000
MAX_SKELETON_BYTES = 1 << 24
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
        if what := placeholder(skeleton_path):
            raise ValueError(what)
        if skeleton_path.stat().st_size > MAX_SKELETON_BYTES:
            raise ValueError(f"more than {MAX_SKELETON_BYTES / 1e6:.0f} MB")
        skeleton = _skeleton(decoded(skeleton_path.read_bytes()))
    except (OSError, ValueError, IndexError, KeyError) as error:
        raise ClipError(
            f"{path}: its skeleton {skeleton_path} is not a readable ASF file ({reason(error)})"
        ) from error
    try:
        text = decoded(path.read_bytes())
        header = _header(text)
        unmoved: set[str] = set()
        numbers, frames = _frames(text, skeleton, unmoved)
    except (OSError, ValueError, IndexError, KeyError) as error:
        raise ClipError(f"{path}: not a readable AMC motion ({reason(error)})") from error
    if not frames:
        raise ClipError(f"{path}: 0 frames; a transition needs at least 2")
    values = {
        bone: np.array([frame[bone] for frame in frames], dtype=np.float64) for bone in frames[0]
    }
    degrees = skeleton.degrees if header.degrees is None else header.degrees
    remarks: list[str] = []
    try:
        values = _filled(numbers, values, skeleton, degrees, remarks)
    except ValueError as error:
        raise ClipError(f"{path}: {error}") from error
    names, parents, offset, local = _pose(skeleton, values, len(values["root"]), degrees)
    position, rotation = forward(parents, offset, local, _root(skeleton, values["root"]))
    if unmoved:
        listed = ", ".join(sorted(unmoved))
        remarks.append(f"values of bones without dof in the skeleton are left out: {listed}")
    still = [name for name, bone in skeleton.bones.items() if bone.dof and name not in values]
    if still:
        remarks.append(f"bones without values in the motion stay at rest: {', '.join(still)}")
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
    """The skeleton file of an AMC file: of its own name, of the longest beginning of it that ends
    at a sign (07.asf of 07_01.amc, HDM_bd.asf of HDM_bd_01-01.amc), or the only one there."""
    found = {p.stem.lower(): p for p in path.parent.iterdir() if p.suffix.lower() == ".asf"}
    own = path.stem.lower()
    fitting = [
        stem
        for stem in found
        if stem and own.startswith(stem) and not own[len(stem) :][:1].isalnum()
    ]
    if fitting:
        return found[max(fitting, key=len)]
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
    stated = [word.lower() for words in parts.get("units", []) for word in words]
    units = dict(zip(stated[::2], stated[1::2], strict=False))
    degrees = not units.get("angle", "deg").startswith("rad")
    length = float(units.get("length", "0"))
    bones: dict[str, Bone] = {}
    for block in _blocks(parts["bonedata"]):
        bone = _bone(block, degrees)
        if bone.name in bones:
            raise ValueError(f"two bones have the name {bone.name}")
        bones[bone.name] = bone
    if len(bones) > MAX_BONES:
        raise ValueError(f"{len(bones)} bones; at most {MAX_BONES} are read")
    if "order" not in root:
        raise ValueError(":root has no order of its values")
    return Skeleton(
        tuple(word.lower() for word in root["order"]),
        root.get("axis", ["XYZ"])[0].lower(),
        _three(root.get("position", ["0", "0", "0"]), "the position of :root"),
        degrees,
        _INCH_M / length if length > 0 else None,
        bones,
        _hierarchy(parts["hierarchy"], bones),
    )


def _hierarchy(part: list[list[str]], bones: Mapping[str, Bone]) -> dict[str, str]:
    """The parent of each bone, all of which the root leads to."""
    known = Names((*bones, "root"))
    parents: dict[str, str] = {}
    for block in _blocks(part):
        for words in block:
            joined = [known.spelled(_unquoted(word)) for word in words]
            for word, name in zip(words, joined, strict=True):
                if name is None:
                    raise ValueError(f"the hierarchy names {word}, which is no bone")
            above, *below = [name for name in joined if name is not None]
            parents |= dict.fromkeys(below, above)
    led = {"root"}
    left = set(parents)
    while reached := {name for name in left if parents[name] in led}:
        led |= reached
        left -= reached
    if left or "root" in parents:
        lost = min(left, default="root")
        raise ValueError(f"the hierarchy of {lost} is a loop that the root does not lead to")
    return parents


def _unquoted(word: str) -> str:
    return word.strip("\"'")


def _three(words: list[str], what: str) -> tuple[float, float, float]:
    if len(words) < 3:
        raise ValueError(f"{what} is not three numbers")
    x, y, z = (float(word) for word in words[:3])
    return x, y, z


def _sections(text: str) -> dict[str, list[list[str]]]:
    parts: dict[str, list[list[str]]] = {}
    name = ""
    for line in lines(text):
        line = line.split("#")[0].strip()
        if line.startswith(":"):
            words = line[1:].split() or [""]
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
    fields: dict[str, list[str]] = {}
    last: list[str] = []
    for first, *rest in block:
        if first.lower() in _DOFS or not first[0].isalpha():
            last += (first, *rest)  # the line before goes on
        else:
            last = fields[first.lower()] = rest
    name = _unquoted(" ".join(fields.get("name", [])[:1]))
    if not name:
        raise ValueError("a bone has no name")
    axis = fields.get("axis", ["0", "0", "0"])
    order = (axis[3] if len(axis) > 3 else "XYZ").lower()
    if not fields.get("length"):
        raise ValueError(f"bone {name} has no length")
    return Bone(
        name=name,
        along=np.array(_three(fields.get("direction", []), f"the direction of bone {name}"))
        * float(fields["length"][0]),
        # lower case: about fixed axes, the first letter first
        axis=Rotation.from_euler(
            order, _three(axis, f"the axis of bone {name}"), degrees=degrees
        ).as_matrix(),
        order=order,
        dof=tuple(word.lower() for word in fields.get("dof", []) if word.lower() in _DOFS),
    )


def _header(text: str) -> Header:
    """What an AMC file states before its first frame."""
    fps: float | None = None
    degrees: bool | None = None
    for line in lines(text):
        line = line.split("#")[0].strip()
        if not line:
            continue
        if line[0] != ":":
            break
        stated = _HEADER.fullmatch(line)
        if stated is None:
            continue
        key = re.sub(r"[\s_-]", "", stated["key"].lower())
        if angles := _ANGLES.fullmatch(key):
            degrees = angles[1] == "deg"
        elif key in _RATES or key == _DURATION:
            word = re.sub(r"(?:fps|hz|s)$", "", with_points(stated["number"] or ""), flags=re.I)
            number = float(word or 0.0)
            if not number > 0:
                raise ValueError(f"{line.split()[0]} states no rate above 0")
            fps = 1.0 / number if key == _DURATION else number
    return Header(fps, degrees)


def _frames(
    text: str, skeleton: Skeleton, unmoved: set[str]
) -> tuple[list[int], list[dict[str, list[float]]]]:
    """The numbers of the frames, and the values by bone of each.

    A row may go over several lines. Bones with freedom that no frame has are left out. Rows of
    bones without freedom, which some programs write, move nothing; `unmoved` collects those that
    are not 0. Raises ValueError where a frame lacks a bone or a value.
    """
    width = {name: len(bone.dof) for name, bone in skeleton.bones.items()}
    width["root"] = len(skeleton.root_order)
    known = Names(tuple(width))
    numbers: list[int] = []
    frames: list[dict[str, list[float]]] = []
    row: list[float] = []
    wanted, number = 0, "1"
    for line in lines(text):
        words = line.split("#")[0].replace("\\", " ").split()
        if not words or words[0][0] == ":":
            continue
        first = _unquoted(words[0])
        name = known.spelled(first)
        if name is None and len(row) < wanted and re.match(r"[-+.\d]", first):
            row += _values(words)  # the line before goes on
            continue
        if len(words) == 1 and re.fullmatch(r"\d{1,9}", first):
            number, wanted = first, 0
            numbers.append(int(first))
            frames.append({})
            continue
        if not frames:
            raise ValueError(f"'{first[:40]}' before the number of the first frame")
        if name is None:
            raise ValueError(f"frame {number} moves {first[:40]}, which is no bone of the skeleton")
        row = _values(words[1:])
        wanted = width[name]
        if not wanted:
            if any(row):
                unmoved.add(name)
            continue
        if name in frames[-1]:
            raise ValueError(f"frame {number} has two rows of {name}: a number of a frame, or a"
                             " value of the row before, is absent")  # fmt: skip
        frames[-1][name] = row
    there = {name for frame in frames for name in frame} | {"root"}
    for at, frame in zip(numbers, frames, strict=True):
        _check_whole(frame, {name: n for name, n in width.items() if name in there}, at)
    return numbers, frames


def _values(words: list[str]) -> list[float]:
    try:
        return [float(word) for word in words]
    except ValueError:
        return [float(word) for word in with_points(" ".join(words)).split()]


def _check_whole(frame: Mapping[str, list[float]], width: Mapping[str, int], number: int) -> None:
    for bone, count in width.items():
        has = len(frame.get(bone, ()))
        if has != count:
            why = "the file is cut short" if has < count else "the skeleton is another's"
            raise ValueError(f"frame {number} has {has} values of {bone}, not {count}: {why}")


def _filled(
    numbers: list[int],
    values: dict[str, np.ndarray],
    skeleton: Skeleton,
    degrees: bool,
    remarks: list[str],
) -> dict[str, np.ndarray]:
    """The values [T, D] of each bone with those of absent frames; see `gaps.filled`."""
    turn = 360.0 if degrees else 2 * np.pi
    periods = {
        bone: [
            turn if kind[0] == "r" else None
            for kind in (skeleton.root_order if bone == "root" else skeleton.bones[bone].dof)
        ]
        for bone in values
    }
    return gaps.filled(numbers, values, periods, remarks)


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

    left = [(child, 0, none) for child in reversed(children.get("root", []))]
    while left:
        name, parent, offset = left.pop()
        bone = skeleton.bones[name]
        turned, moved, along = _moved(bone, values.get(name), degrees, still)
        here = len(names)
        names.append(name)
        parents.append(parent)
        offsets.append(offset + moved)
        local.append(turned)
        left += [(child, here, along) for child in reversed(children.get(name, []))]
        if name not in children:
            names.append(f"{name}_end")
            parents.append(here)
            offsets.append(along)
            local.append(still)
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

"""Parser of the text of BVH files, as programs write it rather than as the format's notes say.

Names with spaces, braces on the line of a name, joints of any channels (none as well), headers
without spaces, frames over several lines, and counts of frames that differ from the rows by a few
are read. The parsers on PyPI refuse these.
"""

import re
from dataclasses import dataclass, field

import numpy as np

from world.motions.text import with_points

#: A count of frames above the rows by at most this many, or this fraction, is the count's fault;
#: beyond, the file is cut short.
_ROWS_FEW, _ROWS_FRACTION = 3, 0.02
MAX_JOINTS = 2000
MAX_CHANNELS = 20_000
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_COMMA = r"[-+]?\d+(?:,\d+)?(?:[eE][-+]?\d+)?"
_TOKEN = re.compile(
    r"(?P<space>[\s;]+)"
    r"|(?P<node>\b(?:ROOT|JOINT)\b[ \t:]*(?P<name>[^\r\n{}]*))"
    r"|(?P<end>\bEnd\s*Site\b[^\r\n{}]*)"
    r"|(?P<offset>\bOFFSET\b[ \t:]*)"
    r"|(?P<channels>\bCHANNELS\b[ \t:]*)"
    r"|(?P<open>\{)|(?P<close>\})"
    r"|(?P<word>[^\s{}]+)",
    re.IGNORECASE,
)
_CHANNEL = re.compile(r"([xyz])_?(pos|trans|rot|scal)[a-z]*", re.IGNORECASE)
_KINDS = {"pos": "p", "trans": "p", "rot": "r", "scal": "s"}


@dataclass
class Joint:
    """A joint of a hierarchy, or an end site, which has no channels."""

    name: str
    parent: int
    """−1 for the root."""
    offset: list[float]
    """[3]: OFFSET, in the file's unit."""
    channels: list[str] = field(default_factory=list)
    """Kind and axis of each channel: p position, r rotation, s scale, e.g. rz."""
    first: int = 0
    """Column of the first channel."""
    is_end: bool = False


@dataclass(frozen=True)
class Motion:
    """The content of a BVH file."""

    joints: list[Joint]
    rows: np.ndarray
    """[T, C]: values of all channels."""
    frame_s: float | None
    """Duration of a frame, s; None where the file has none."""
    remarks: tuple[str, ...]
    """What was corrected, in words."""


def parsed(text: str) -> Motion:
    """The content of a file's text. Raises ValueError, which says what is wrong and where."""
    above, motion = _split(text)
    if motion is None:
        raise ValueError("no MOTION: the file is cut short")
    joints, width = _hierarchy(above)
    rows, frame_s, remarks = _motion(motion, width)
    roots = [index for index, joint in enumerate(joints) if joint.parent < 0]
    if len(roots) > 1:
        left_out = ", ".join(joints[index].name for index in roots[1:])
        remarks.append(f"the first of {len(roots)} skeletons is read; left out: {left_out}")
        joints = joints[: roots[1]]
    return Motion(joints, rows, frame_s, tuple(remarks))


def hierarchy(text: str) -> list[Joint]:
    """The joints and end sites of the first skeleton of a file's text, which may lack a motion.
    Raises ValueError."""
    joints, _ = _hierarchy(_split(text)[0])
    roots = [index for index, joint in enumerate(joints) if joint.parent < 0]
    return joints[: roots[1]] if len(roots) > 1 else joints


def _split(text: str) -> tuple[str, str | None]:
    """The hierarchy and the motion of a file's text; None without a motion."""
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    text = re.sub(r"^[ \t]*(?:#|//).*$", "", text, flags=re.MULTILINE)
    if not text.strip():
        raise ValueError("it is empty")
    if not re.match(r"\s*HIERARCHY\b", text, re.IGNORECASE):
        raise ValueError("it does not begin with HIERARCHY")
    # on a line of its own, or behind the last brace of a file without line breaks
    found = re.search(
        r"^[ \t}]*(MOTION)\b|\}\s*(MOTION)\s+Frames\b", text, re.IGNORECASE | re.MULTILINE
    )
    if found is None:
        return text, None
    start, end = found.span(1 if found[1] else 2)
    return text[:start], text[end:]


def _hierarchy(text: str) -> tuple[list[Joint], int]:
    """The joints and end sites of a hierarchy, parents first, and the number of its channels."""
    joints: list[Joint] = []
    above: list[int] = []
    width, at = 0, re.match(r"\s*HIERARCHY\b", text, re.IGNORECASE).end()  # pyright: ignore[reportOptionalMemberAccess]
    pending = -1
    while at < len(text):
        token = _TOKEN.match(text, at)
        assert token is not None
        kind, at = token.lastgroup, token.end()
        if token["node"] is not None or kind == "end":
            parent = above[-1] if above else -1
            if kind == "end":
                name = f"{joints[parent].name}_end" if parent >= 0 else "end"
            else:
                name = token["name"].strip().strip("\"'") or f"joint{len(joints)}"
            pending = len(joints)
            joints.append(Joint(name, parent, [0.0, 0.0, 0.0], first=width, is_end=kind == "end"))
            if len(joints) > MAX_JOINTS:
                raise ValueError(f"more than {MAX_JOINTS} joints")
        elif kind == "open":
            if pending < 0:
                raise ValueError("a brace opens that belongs to no joint")
            above.append(pending)
            pending = -1
        elif kind == "close":
            if not above:
                raise ValueError("a brace closes that never opened")
            above.pop()
        elif kind == "offset":
            at = _offset(text, at, joints[_open(above, "an OFFSET")])
        elif kind == "channels":
            joint = joints[_open(above, "CHANNELS")]
            at = _channels(text, at, joint)
            width += len(joint.channels)
            if width > MAX_CHANNELS:
                raise ValueError(f"more than {MAX_CHANNELS} channels")
        elif kind == "word":
            where = joints[-1].name if joints else "the hierarchy"
            raise ValueError(f"'{token['word'][:40]}' after {where}: expected OFFSET, CHANNELS,"
                             " JOINT, End Site or a brace")  # fmt: skip
    if not joints:
        raise ValueError("no ROOT")
    if above:
        raise ValueError(f"the braces of {joints[above[-1]].name} do not close")
    return joints, width


def _open(above: list[int], what: str) -> int:
    if not above:
        raise ValueError(f"{what} outside a joint's braces")
    return above[-1]


def _offset(text: str, at: int, joint: Joint) -> int:
    """Read the OFFSET of a joint; return the place behind it."""
    form = re.compile(rf"\s*({_NUMBER})[\s,]+({_NUMBER})[\s,]+({_NUMBER})")
    commas = re.compile(rf"\s*({_COMMA})\s+({_COMMA})\s+({_COMMA})(?![\d.,])")
    found = commas.match(text, at) or form.match(text, at)
    if not found:
        raise ValueError(f"the OFFSET of {joint.name} is not three numbers")
    joint.offset = [float(value.replace(",", ".")) for value in found.groups()]
    return found.end()


def _channels(text: str, at: int, joint: Joint) -> int:
    """Read the CHANNELS of a joint; return the place behind them."""
    found = re.compile(r"\s*(\d{1,6})(?!\d)").match(text, at)
    if not found:
        raise ValueError(f"CHANNELS of {joint.name} has no count")
    at, names = found.end(), []
    word = re.compile(r"[\s,]*([A-Za-z_]+)")
    while (one := word.match(text, at)) and (channel := _CHANNEL.fullmatch(one[1])):
        names.append(_KINDS[channel[2].lower()] + channel[1].lower())
        at = one.end()
    if len(names) != int(found[1]):
        raise ValueError(
            f"CHANNELS of {joint.name} promises {found[1]} and names {len(names)}; channels are"
            " Xposition, Yposition, Zposition, Xrotation, Yrotation, Zrotation"
        )
    joint.channels = names
    return at


def _motion(text: str, width: int) -> tuple[np.ndarray, float | None, list[str]]:
    """Rows [T, width], the duration of a frame, and remarks."""
    if not width:
        raise ValueError("no joint has CHANNELS: nothing moves")
    remarks: list[str] = []
    count = re.search(r"(?:^|\s)Frames[ \t]*:?[ \t]*(-?\d+(?:\.0*)?)(?!\S)", text, re.IGNORECASE)
    step = re.search(r"(?:^|\s)Frame\s*Time[ \t]*:?[ \t]*(\S*)", text, re.IGNORECASE)
    start = max((found.end() for found in (count, step) if found), default=0)
    promised = max(0, int(float(count[1]))) if count else None
    lines = [line.split() for line in with_points(text[start:]).splitlines()]
    lines = [words for words in lines if words]
    rows = _rows(lines, width, promised)
    frames = len(rows)
    if (total := sum(map(len, lines))) % width:
        raise ValueError(
            f"its last frame has {total % width} values of {width}: the file is cut short"
        )
    if promised is None:
        remarks.append(f"no count of frames: its {frames} rows are read")
    elif frames < promised - max(_ROWS_FEW, _ROWS_FRACTION * promised):
        raise ValueError(f"{frames} rows of {promised} frames: the file is cut short")
    elif frames != promised:
        remarks.append(f"{frames} rows are read, the count of frames is another ({promised})")
    return rows, _seconds(step[1]) if step else None, remarks


def _seconds(word: str) -> float | None:
    """The duration of a frame, also with a decimal comma or as a fraction; None where it is no
    number."""
    above, _, below = word.replace(",", ".").partition("/")
    try:
        return float(above) / float(below or 1.0)
    except (ValueError, ZeroDivisionError):
        return None


def _rows(lines: list[list[str]], width: int, promised: int | None) -> np.ndarray:
    """Rows [T, width] of the lines' words; frames may go over several lines."""
    lengths = np.array([len(words) for words in lines], dtype=np.int64)
    ends = np.cumsum(lengths)
    total = int(ends[-1]) if len(ends) else 0
    frames = total // width
    usual = int(np.bincount(lengths).argmax()) if total else width
    # each frame begins on a line of its own, or the text is wrapped and the count agrees
    begins = set(ends.tolist())
    wrapped = usual != width and promised is not None and promised * width == total
    if any(frame * width not in begins for frame in range(1, frames + 1)) and not wrapped:
        odd = int(np.argmax(lengths != width))
        what = f"row {odd + 1} has {lengths[odd]}" if usual == width else f"a frame has {usual}"
        raise ValueError(f"{what} values, not {width}, for the channels of the hierarchy")
    words = [word for line in lines for word in line][: frames * width]
    try:
        values = np.fromiter(map(float, words), np.float64, len(words))
    except ValueError:
        at = next(index for index, word in enumerate(words) if not _is_number(word))
        raise ValueError(f"'{words[at][:20]}' in frame {at // width} is no number") from None
    return values.reshape(frames, width)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True

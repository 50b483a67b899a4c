"""The registry of motion formats, and detection of a file's format.

A new format is a file and a line here. Training reads the format `clip` alone; `motions import`
makes clips of the others.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from world.errors import ChoiceError, ClipError
from world.motions import npz
from world.motions.formats import (
    acclaim,
    amass,
    bvh,
    deepmimic,
    mimickit,
    omomo,
    own,
    poselib,
    safe_pickle,
    samp_pickle,
)
from world.motions.formats.recording import RateMissingError, Recording, validate
from world.motions.licences import dataset
from world.placeholders import placeholder
from world.refusals import refusing, unknown_suffix
from world.surroundings import expanded

MAX_FILE_BYTES = 1 << 29
"""Greatest size of a motion file: hours of motion."""


@dataclass(frozen=True)
class Format:
    """One format: suffixes, fields by which it is detected, and reader."""

    suffixes: tuple[str, ...]
    read: Callable[[Path], Recording]
    keys: tuple[tuple[str, ...], ...] = ()
    """Alternative sets of fields, of which a file has one in full; empty for a format with a suffix
    of its own."""


FORMATS = {
    "bvh": Format(bvh.SUFFIXES, bvh.read),
    "acclaim": Format(acclaim.SUFFIXES, acclaim.read),
    "deepmimic": Format(deepmimic.SUFFIXES, deepmimic.read),
    "clip": Format(own.SUFFIXES, own.read, (own.KEYS,)),
    "amass": Format(
        amass.SUFFIXES,
        amass.read,
        (("trans", "poses"), ("trans", "root_orient", "pose_body")),
    ),
    "samp": Format(samp_pickle.SUFFIXES, samp_pickle.read, (samp_pickle.KEYS,)),
    "mimickit": Format(mimickit.SUFFIXES, mimickit.read, (mimickit.KEYS,)),
    "omomo": Format(omomo.SUFFIXES, omomo.read),
    "poselib": Format(poselib.SUFFIXES, poselib.read),
}
#: Fields of a person's shape, and fields of any motion.
_SHAPE = frozenset(("betas", "gender"))
_MOTION = frozenset(
    ("trans", "poses", "root_orient", "pose_body", "root_position_m", "local_rotation_wxyz")
)
SUFFIXES = tuple(sorted({suffix for f in FORMATS.values() for suffix in f.suffixes}))


def read(path: Path, name: str | None = None, fps: float | None = None) -> Recording:
    """The motion in a file, of the named or the detected format, at a given rate if any.

    Raises ClipError where it has no usable motion, ChoiceError for an unknown format.
    """
    if name is not None and name not in FORMATS:
        raise ChoiceError("format", name, list(FORMATS))
    with refusing(ClipError, path, "motion"):
        _bounded(path)
        _real(path)
        try:
            found = FORMATS[name or detected(path)].read(path)
        except RateMissingError as error:
            if fps is None:
                raise
            found = error.recording
        found = replace(found, dataset=dataset(path))
        return validate(found if fps is None else replace(found, fps=fps, fps_assumed=False))


def _bounded(path: Path) -> None:
    size = path.stat().st_size
    if size > MAX_FILE_BYTES:
        raise ClipError(f"{path}: {size / 1e6:.0f} MB; at most {MAX_FILE_BYTES / 1e6:.0f} are read")


def _real(path: Path) -> None:
    """Raise ClipError for a file that stands in place of data."""
    what = placeholder(path)
    if what:
        raise ClipError(f"{path}: {what}")


def detected(path: Path) -> str:
    """The format of a file by its suffix and, where several share one, by its fields."""
    fitting = {n: f for n, f in FORMATS.items() if path.suffix.lower() in f.suffixes}
    if path.suffix.lower() == ".asf":
        raise ClipError(f"{path}: a skeleton without motion; name the .amc files beside it")
    if not fitting:
        raise ClipError(
            f"{path}: {unknown_suffix(path)}; motions come as {', '.join(SUFFIXES)}"
            f" (formats: {', '.join(FORMATS)})"
        )
    if len(fitting) == 1:
        return next(iter(fitting))
    _real(path)
    fields = _fields(path)
    for name, one in fitting.items():
        if any(set(keys) <= set(fields) for keys in one.keys):
            return name
    wanted = "; ".join(
        f"{name}: {' or '.join(', '.join(keys) for keys in one.keys)}"
        for name, one in fitting.items()
    )
    held = ", ".join(sorted(fields)[:20]) or "nothing"
    raise ClipError(f"{path}: none of the formats that end so; it holds {held}; expected {wanted}")


def _fields(path: Path) -> tuple[str, ...]:
    if path.suffix.lower() == ".npz":
        with refusing(ClipError, path, ".npz file"), npz.opened(path) as file:
            return tuple(file)
    return safe_pickle.keys(safe_pickle.load(path), path)


def is_companion(path: Path) -> bool:
    """Whether a file lies among motions and holds none: AMASS keeps shapes and fits beside them.

    A damaged file is none of these.
    """
    if path.suffix.lower() != ".npz":
        return False
    try:
        with npz.opened(path) as file:
            fields = frozenset(file)
    except Exception:  # a damaged file raises any exception: its reader says so
        return False
    return bool(fields & _SHAPE) and not fields & _MOTION


def find(paths: list[Path], name: str | None = None) -> list[Path]:
    """The motion files of files and folders, sorted. Raises ClipError for a path without any."""
    if name is not None and name not in FORMATS:
        raise ChoiceError("format", name, list(FORMATS))
    suffixes = FORMATS[name].suffixes if name else SUFFIXES
    found: list[Path] = []
    for path in map(expanded, paths):
        if path.is_dir():
            here = sorted(p for p in path.rglob("*") if _may_be(p, suffixes))
        elif path.is_file():
            here = [path]
        else:
            raise ClipError(f"{path}: no such file or folder of motions")
        if not here:
            raise ClipError(f"{path}: no motions found; they end in {', '.join(suffixes)}")
        found += here
    return found


def _may_be(path: Path, suffixes: tuple[str, ...]) -> bool:
    """Whether a file in a folder may be a motion: notes and licences are .txt files, too."""
    suffix = path.suffix.lower()
    if suffix not in suffixes or not path.is_file():
        return False
    if suffix in deepmimic.SUFFIXES:
        with path.open("rb") as file:
            return b'"Frames"' in file.read(4096)
    return True

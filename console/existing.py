"""Files that are already where a command is to write: what they are, by their content.

A command replaces a file that it wrote itself before, and no other. Where the content of a format
does not tell who wrote it (films, pictures), a file of that format is replaced.
"""

import json
import zipfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from world.errors import ConfigError

EVALUATION = "an evaluation of inhabit evaluate"
REALISM = "figures of inhabit realism"
PLAN = "an estimate of inhabit plan"
BENCHMARK = "figures of inhabit bench"
PAGE = "a page of inhabit"
RECORDING = "a recording of inhabit"
#: Keys by which a JSON file is recognised.
_KEYS = {
    EVALUATION: {"task", "checkpoint", "trials", "objects", "perturbation"},
    REALISM: {"source", "reference", "folds", "phases"},
    PLAN: {"fleet", "costs", "estimate"},
    BENCHMARK: {"name", "machine", "figures"},
}
#: What the files of a command's --json are.
OF_JSON = {"Evaluate": EVALUATION, "Realism": REALISM, "Plan": PLAN, "Bench": BENCHMARK}
_OTHER_JSON, _ZIP, _TEXT, _DATA = (
    "other JSON",
    "an archive (zip)",
    "a text",
    "a file of no known kind",
)
_ONNX, _BVH, _GLTF, _SMPL = (
    f"{what} that inhabit exported"
    for what in ("an ONNX model", "a BVH motion", "a glTF motion", "an SMPL motion")
)
_SIGNATURES: dict[str, Callable[[bytes], bool]] = {
    "a PNG picture": lambda head: head.startswith(b"\x89PNG"),
    "a GIF picture": lambda head: head.startswith(b"GIF8"),
    "a WebP picture": lambda head: head[:4] == b"RIFF" and head[8:12] == b"WEBP",
    "an MP4 film": lambda head: head[4:8] == b"ftyp",
    RECORDING: lambda head: b"inhabit-recording" in head[:64],
    _ONNX: lambda head: b"\x12\x07inhabit" in head[:16],
    PAGE: lambda head: _is_page(head, (b'name="generator" content="inhabit', b"<title>inhabit ")),
    "an HTML page": lambda head: _is_page(head, (b"<",)),
    "another BVH motion": lambda head: head.lstrip().startswith(b"HIERARCHY"),
    "a PDF document": lambda head: head.startswith(b"%PDF"),
}
#: What the other files of commands are, by the ending of their names.
OF_SUFFIX = {
    ".png": "a PNG picture", ".gif": "a GIF picture", ".webp": "a WebP picture",
    ".mp4": "an MP4 film", ".msgpack": RECORDING, ".onnx": _ONNX, ".html": PAGE, ".htm": PAGE,
    ".bvh": _BVH, ".glb": _GLTF, ".gltf": _GLTF, ".npz": _SMPL,
}  # fmt: skip
_HEAD_BYTES, _READ_BYTES = 1 << 14, 1 << 27


def require(path: Path, flag: str, wanted: str) -> None:
    """Raise ConfigError, which names the flag, for an existing file that is not what is wanted.

    An empty file has nothing to lose. A device or a pipe cannot be replaced.
    """
    try:
        if not path.exists():
            return
        if not path.is_file():
            raise ConfigError(f"{flag}{path}: no regular file; name another file")
        if not path.stat().st_size:
            return
        found = kind_of(path)
    except OSError as error:
        raise ConfigError(f"{flag}{path}: {error.strerror}") from None
    if found != wanted:
        raise ConfigError(
            f"{flag}{path}: exists and is {found}, not {wanted}; name another file, or remove it"
        )


def kind_of(path: Path) -> str:
    """Return what a file is, in a few words. Raises OSError."""
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
    for kind, matches in _SIGNATURES.items():
        if matches(head):
            beside = path.with_name(f"{path.name}.license")
            return _BVH if "BVH" in kind and beside.is_file() else kind
    if head.startswith(b"glTF") or path.suffix.lower() == ".gltf":
        return _of_gltf(path)
    if head.lstrip()[:1] in (b"{", b"["):
        return _of_json(path)
    if head.startswith(b"PK"):
        with suppress(zipfile.BadZipFile, OSError), zipfile.ZipFile(path) as archive:
            names = set(archive.namelist())
            return _SMPL if {"poses.npy", "trans.npy", "licence.npy"} <= names else _ZIP
    try:
        head.decode(errors="strict" if len(head) < _HEAD_BYTES else "ignore")
    except ValueError:
        return _DATA
    return _DATA if b"\0" in head else _TEXT


def _is_page(head: bytes, marks: tuple[bytes, ...]) -> bool:
    begins = head.lstrip()[:9].lower()
    return begins.startswith((b"<!doctype", b"<html")) and any(mark in head for mark in marks)


def _of_gltf(path: Path) -> str:
    """Return whether a glTF is of inhabit, or a user's with a motion that inhabit put on it."""
    with path.open("rb") as file:
        content = file.read(_READ_BYTES)
    marks = (b'"generator":"inhabit', b'"generator": "inhabit', b'"motion_licence"')
    return _GLTF if any(mark in content for mark in marks) else "another glTF scene"


def _of_json(path: Path) -> str:
    if path.stat().st_size > _READ_BYTES:
        return _OTHER_JSON
    try:
        value = json.loads(path.read_bytes())
    except (ValueError, RecursionError):
        return _TEXT
    keys = set(value) if isinstance(value, dict) else set()
    return next((kind for kind, own in _KEYS.items() if own <= keys), _OTHER_JSON)

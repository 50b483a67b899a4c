"""Files that are already where a command is to write: what they are, by their content.

A command replaces a file that it wrote itself before, and no other. Formats whose content does not
tell who wrote it hold `MARK`: films and pictures in their metadata, BVH in the licence beside it.
"""

import json
import struct
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
#: The comment of films and GIF pictures, and the description of other pictures, of inhabit.
MARK = "made by inhabit"
#: Tags of EXIF, as in WebP pictures.
DESCRIPTION, COPYRIGHT = 0x010E, 0x8298
#: Key of the description in PNG pictures.
PNG_DESCRIPTION = "Description"
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
_PICTURES, _FILM = ("a PNG picture", "a GIF picture", "a WebP picture"), "an MP4 film"
#: What the other files of commands are, by the ending of their names.
OF_SUFFIX = {
    ".png": "a PNG picture of inhabit", ".gif": "a GIF picture of inhabit",
    ".webp": "a WebP picture of inhabit", ".mp4": "an MP4 film of inhabit",
    ".msgpack": RECORDING, ".onnx": _ONNX, ".html": PAGE, ".htm": PAGE,
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
            if (kind in _PICTURES and _is_own_picture(path)) or (
                kind == _FILM and _is_own_film(path)
            ):
                return f"{kind} of inhabit"
            return _BVH if "BVH" in kind and _is_own_bvh(path) else kind
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


def _is_own_bvh(path: Path) -> bool:
    """Return whether the licence beside a BVH says who made it: the format itself has no place."""
    with suppress(OSError):
        return MARK in path.with_name(f"{path.name}.license").read_text(errors="replace")
    return False


def _is_own_picture(path: Path) -> bool:
    """Return whether the metadata of a picture hold MARK; False for a damaged one."""
    from PIL import Image  # a tenth of a second, which other files do not need

    try:
        with Image.open(path) as picture:
            comment = picture.info.get("comment", b"")
            found = {picture.info.get(PNG_DESCRIPTION), picture.getexif().get(DESCRIPTION)}
    # whatever a parser raises: a picture that cannot be read is none of inhabit
    except Exception:
        return False
    return MARK in found or (isinstance(comment, bytes) and comment.startswith(MARK.encode()))


def _is_own_film(path: Path) -> bool:
    """Return whether the comment of an MP4 film is MARK."""
    with path.open("rb") as file:
        while len(header := file.read(8)) == 8:
            size, kind = struct.unpack(">I4s", header)
            head = len(header)
            if size == 1:  # a longer size follows
                size, head = int.from_bytes(file.read(8), "big"), 16
            if size < head:  # to the end of the file, or damaged
                return False
            if kind == b"moov":
                # the value begins after its own size, kind, type and language
                _, comment, rest = file.read(min(size - head, _READ_BYTES)).partition(b"\xa9cmt")
                return bool(comment) and rest[16:].startswith(MARK.encode())
            file.seek(size - head, 1)
    return False


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

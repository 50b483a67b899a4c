"""Checks of the files that a command is asked to write, before the work that they are to hold."""

import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from console import existing
from world.errors import ConfigError

FIELDS = ("run", "state", "out", "json", "record", "sheet", "html")
"""Fields of files and folders that a command writes; `json` is elsewhere no path"""
_FOLDERS = {
    ("Train", "run"), ("Style", "state"), ("Publish", "out"), ("MotionsImport", "out"),
    ("MotionsVary", "out"), ("ObjectsImport", "out"),
}  # fmt: skip
_SUFFIXES = {"html": (".html", ".htm"), "sheet": (".png",), "record": (".msgpack",)}
"""Suffixes of files by field, where they are the same for all commands"""
_PAGES = {("Report", "out"), ("Evaluate", "out")}
_FILES = _PAGES | {("Video", "out")}
"""Outputs `out` that are one file"""
_WORDS = {(kind, "out") for kind in ("Publish", "Video", "Export")}
"""Commands whose output is a word, without a flag"""


def check(path: Path | None, flag: str, suffixes: Sequence[str]) -> None:
    """Raise ConfigError, which names the flag, unless a file of one of the suffixes can be written.

    Nothing is checked for None, a file that is not wanted.
    """
    if path is None:
        return
    if path.suffix.lower() not in suffixes:
        named = f" is '{path.suffix}'" if path.suffix else " is missing"
        raise ConfigError(f"{flag} {path}: its suffix{named}; choose {' or '.join(suffixes)}")
    if path.is_dir():
        raise ConfigError(f"{flag} {path}: a folder; name a file")
    _writable(path, f"{flag} ")


def require(command: Any, read: Sequence[Path] = ()) -> None:
    """Raise ConfigError, which names flag and value, for an output whose folder cannot be written,
    for a file where a folder is to be written or the other way round, for one of the files that
    are `read`, and for an existing file that the command did not write."""
    kind = type(command).__name__
    for field in dataclasses.fields(command):
        if field.name not in FIELDS:
            continue
        value = getattr(command, field.name)
        flag = "" if (kind, field.name) in _WORDS else f"--{field.name} "
        for path in value if isinstance(value, tuple) else (value,):
            if isinstance(path, Path):
                suffixes = _SUFFIXES.get(field.name, (path.suffix.lower(),))
                if (kind, field.name) in _PAGES:
                    suffixes = _SUFFIXES["html"]
                if path.suffix.lower() not in suffixes:
                    raise ConfigError(f"{flag}{path}: choose {' or '.join(suffixes)}")
                if path.is_file() and (kind, field.name) in _FOLDERS:
                    raise ConfigError(f"{flag}{path}: a file; name a folder")
                whole = field.name in ("json", *_SUFFIXES) or (kind, field.name) in _FILES
                if whole and path.is_dir():
                    raise ConfigError(f"{flag}{path}: a folder; name a file")
                if path.is_file() and any(path.samefile(one) for one in read):
                    raise ConfigError(f"{flag}{path}: the command reads it; name another file")
                _writable(path, flag)
                one_file = whole or (kind, field.name) == ("Export", "out")
                wanted = _wanted(kind, field.name, path) if one_file else None
                if wanted is not None:
                    existing.require(path, flag, wanted)


def _wanted(kind: str, field: str, path: Path) -> str | None:
    """Return what a file must be that a command replaces; None for an unknown suffix, which the
    command refuses."""
    if field == "json":
        return existing.OF_JSON[kind]
    return existing.OF_SUFFIX.get(path.suffix.lower())


def _writable(path: Path, flag: str) -> None:
    try:
        folder = next(folder for folder in path.absolute().parents if folder.exists())
    except OSError as error:
        raise ConfigError(f"{flag}{path}: {error.strerror}") from None
    if not (folder.is_dir() and os.access(folder, os.W_OK)):
        raise ConfigError(f"{flag}{path}: {folder} is not a writable folder")

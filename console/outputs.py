"""Checks of the files that a command is asked to write, before the work that they are to hold."""

import os
from collections.abc import Sequence
from pathlib import Path

from world.errors import ConfigError


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
    folder = next(folder for folder in path.absolute().parents if folder.exists())
    if not (folder.is_dir() and os.access(folder, os.W_OK)):
        raise ConfigError(f"{flag} {path}: {folder} is not a writable folder")

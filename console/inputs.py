"""Paths of input on the command line, checked before a command runs, dry or not."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pretrained
from console.bounds import UNNAMED
from world.errors import ConfigError
from world.surroundings import expanded

#: Flags whose value is a file or folder that must be there, by field; those of `doctor` are checked
#: as findings, and a missing RUN is refused where it is read.
FIELDS = (
    "motions",
    "objects",
    "init",
    "walker",
    "against",
    "evaluation",
    "map",
    "tls_ca",
    "tls_cert",
    "tls_key",
    "tls_client_ca",
    "token_file",
)
_ELSEWHERE = ("Doctor", "ObjectsList", "ObjectsShow")
"""Commands whose own fields of these names are findings, or words without a flag"""


def require(command: Any, prefix: str = "--") -> None:
    """Raise ConfigError, which names flag and value, for a path of input that is not there."""
    if type(command).__name__ in _ELSEWHERE:
        return
    for field in dataclasses.fields(command):
        value = getattr(command, field.name)
        name = field.name.replace("_", "-")
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            if field.name != "experiment":  # its paths are those of --motions and --objects
                require(value, prefix if field.name in UNNAMED else f"{prefix}{name}.")
        elif field.name in FIELDS:
            for one in _given(value):
                if not _there(field.name, one):
                    raise ConfigError(f"{prefix}{name} {one}: {_wanted(field.name)}")


def _given(value: object) -> Iterator[str]:
    """The words of a field that may hold one, several or none."""
    if isinstance(value, str | Path):
        if str(value):
            yield str(value)
    elif isinstance(value, tuple | list):
        for one in value:
            yield from _given(one)


def _splits() -> tuple[str, ...]:
    """Names that stand for pieces of the catalogue."""
    from world.furniture.bands import SPLITS  # imports numpy, which most commands start without

    return (*SPLITS, "all")


def _there(field: str, word: str) -> bool:
    if (field == "objects" and word in _splits()) or (
        field == "init" and word in pretrained.names()
    ):
        return True
    try:
        return expanded(Path(word)).exists()
    except OSError:
        return False


def _wanted(field: str) -> str:
    """What the value of a flag must be."""
    if field == "objects":
        return f"no such file or folder; choose {', '.join(_splits())} or a path of pieces"
    if field == "init":
        names = ", ".join(pretrained.names())
        return f"no such run or checkpoint folder; the names of policies are {names}"
    return "no such file or folder"

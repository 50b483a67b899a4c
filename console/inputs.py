"""Paths of input on the command line, checked before a command runs, dry or not."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pretrained
from console.bounds import UNNAMED
from world.errors import ConfigError
from world.surroundings import expanded

RUNS = ("source", "sources", "policies", "policy")
"""Fields of a run, a checkpoint folder, a policy's name, or a file of motion"""
PATHS = ("paths",)
"""Fields of words that name files or folders to read"""
#: Flags whose value is a file or folder that must be there, by field; those of `doctor` are checked
#: as findings.
FIELDS = (
    *RUNS,
    *PATHS,
    "motions",
    "objects",
    "init",
    "walker",
    "against",
    "evaluation",
    "map",
    "rig",
    "joint_map",
    "tls_ca",
    "tls_cert",
    "tls_key",
    "tls_client_ca",
    "token_file",
)
_WORDS = (*RUNS[:3], *PATHS)
"""Fields that are words of the command, without a flag"""
_POLICIES = (*RUNS, "init", "walker", "tracker", "expert", "rollouts")
"""Fields whose words may be the name of a policy"""
_SERVED = ("sources", "policies")
"""Fields whose words may be NAME=RUN"""


def require(command: Any, prefix: str = "--") -> None:
    """Raise ConfigError, which names flag and value, for a path of input that is not there."""
    kind = type(command).__name__
    if kind == "Doctor":
        return
    words = _WORDS + (("objects",) if kind in ("ObjectsList", "ObjectsShow") else ())
    for field in dataclasses.fields(command):
        value = getattr(command, field.name)
        name = field.name.replace("_", "-")
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            if field.name not in ("experiment", "world"):  # see --motions and --objects
                require(value, prefix if field.name in UNNAMED else f"{prefix}{name}.")
        elif field.name in FIELDS:
            if field.name in PATHS and value == () and field.default is dataclasses.MISSING:
                raise ConfigError("PATH: missing: name the files or folders")
            for one in _given(value):
                pieces = field.name == "objects" or kind == "ObjectsCheck"
                forms = {one, one.partition("=")[2] or one} if field.name in _SERVED else {one}
                if not any(_there("objects" if pieces else field.name, form) for form in forms):
                    flag = "" if field.name in words else f"{prefix}{name} "
                    raise ConfigError(
                        f"{flag}{one}: {_wanted(field.name, pieces, kind.startswith('Objects'))}"
                    )


def files(command: Any) -> Iterator[Path]:
    """The files that the flags and words of a command name to be read."""
    for field in dataclasses.fields(command):
        value = getattr(command, field.name)
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            yield from files(value)
        elif field.name in FIELDS:
            yield from (Path(one) for one in _given(value) if Path(one).is_file())


def namesakes(command: Any) -> Iterator[str]:
    """Yield a line for each folder that is read and has the name of a policy of the package, which
    the user may have meant."""
    kind = type(command).__name__
    if kind == "Doctor":
        return
    for field in dataclasses.fields(command):
        value = getattr(command, field.name)
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            yield from namesakes(value)
        elif field.name in _POLICIES or (kind, field.name) == ("TrackConfig", "teacher"):
            for one in _given(value):
                name = one if Path(one).is_dir() else one.partition("=")[2]
                meant = pretrained.folder(name)
                if meant is not None and Path(name).is_dir() and not meant.samefile(name):
                    yield f"{name}: the folder here is used, not the package's policy of that name"


def _given(value: object) -> Iterator[str]:
    """The words of a field that may hold one, several or none."""
    if isinstance(value, str | Path):
        if str(value):
            yield str(value)
    elif isinstance(value, tuple | list):
        for one in value:
            yield from _given(one)


def _splits(every: bool) -> tuple[str, ...]:
    """Names that stand for pieces of the catalogue; every: also the one for all of them, which
    neither trains nor evaluates."""
    from world.furniture.bands import SPLITS  # imports numpy, which most commands start without

    return (*SPLITS, "all") if every else SPLITS


def _there(field: str, word: str) -> bool:
    if (field == "objects" and word in _splits(True)) or (
        field in ("init", *RUNS) and word in pretrained.names()
    ):
        return True
    try:
        return expanded(Path(word)).exists()
    except OSError:
        return False


def _wanted(field: str, pieces: bool, every: bool) -> str:
    """What the value of a flag must be."""
    if pieces:
        return f"no such file or folder; choose {', '.join(_splits(every))} or a path of pieces"
    names = ", ".join(pretrained.names())
    if field == "init":
        return f"no such run or checkpoint folder; the names of policies are {names}"
    if field in RUNS:
        return f"no such run, checkpoint folder or file; the names of policies are {names}"
    return "no such file or folder"

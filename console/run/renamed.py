"""Renamed and removed settings: old experiment JSON is converted, old flags are refused with the
new name."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

from world.errors import ConfigError


@dataclass(frozen=True)
class Converted:
    """A renamed setting whose value changes too."""

    key: str
    """Dotted name today."""
    convert: Callable[[Any], Any]
    """Today's value of an old one."""


Table = Mapping[str, str | Converted | None]
"""Today's dotted name by the old one, as in an experiment's JSON; None: the setting is removed."""

RENAMED: Table = {
    "world.carry.porter": None,
    "world.teacher": None,
    "world.carry.lesson": None,
    "world.carry.led": None,
    "ppo.lesson_weight": "ppo.imitation_weight",
    "overlap": "lag.overlap",
    "max_policy_lag": "lag.max_policy",
    "max_style_lag": "lag.max_style",
    "world.paces": "world.playback_speeds",
    "world.patience_s": "world.stall_s",
    "world.carry.walker": "world.walker",
    "world.carry.tracker": "world.tracker",
    "world.starts.clip": "world.initial.reference",
    "world.starts.near": "world.initial.near",
    "world.starts.far": "world.initial.far",
    "world.clip_stages": "world.initial.reference_stages",
    "world.raised": "world.initial.raised_seat_fraction",
    "world.standing": "world.initial.standing_fraction",
    "world.near_m": "world.initial.near_m",
    "world.front": "world.initial.front_fraction",
    "world.front_m": "world.initial.front_m",
    "world.far_m": "world.initial.far_m",
    "world.ahead": "world.initial.ahead_fraction",
    "style.held_out": None,
}

TAUGHT = ("world.carry.porter", "world.teacher")
"""Removed settings that, where they are set, named a teacher that is gone: a training would go on
as another one without it."""

RENAMED_SERVE: Table = {
    "max_situations": "max_poses",
    "synthesis.ahead": "synthesis.buffer_frames",
}
"""The same for the flags of `serve`."""

REPEATED: Mapping[str, str] = {
    "world.task": "the word TASK",
    "world.motions": "--motions",
    "world.objects": "--objects",
    "ppo.threads": "--threads",
    "before": "--recipe",
    "stages": "--recipe",
}
"""Settings of an experiment that another flag of `train` sets; they have no flag of their own."""

RENAMED_METRICS = {
    f"episode/{figure}_clip": f"episode/{figure}_reference"
    for figure in ("success", "fall", "length")
} | {"ppo/lesson": "ppo/imitation"}
"""Today's name of a figure in metrics.jsonl by its old one."""


def current(experiment: Mapping[str, Any], table: Table = RENAMED) -> dict[str, Any]:
    """Return an experiment's JSON with today's names; other settings stay unchanged.

    Removed settings are left out. Raises ConfigError for a setting under both of its names.
    """
    found = deepcopy(dict(experiment))
    for old, new in table.items():
        if not _holds(found, old):
            continue
        value = _take(found, old)
        if new is None:
            continue
        key = new.key if isinstance(new, Converted) else new
        if _holds(found, key):
            raise ConfigError(f"{old} is today's {key}, and both are set: leave {old} out")
        _put(found, key, new.convert(value) if isinstance(new, Converted) else value)
    return found


def taught_by(experiment: Mapping[str, Any]) -> str | None:
    """Return the setting by which an experiment's JSON names a teacher that is gone; None without
    one."""
    for key in TAUGHT:
        if _holds(experiment, key):
            *_, (parent, name) = _path(experiment, key)
            if parent[name]:
                return key
    return None


def current_metrics(line: Mapping[str, Any]) -> dict[str, Any]:
    """Return one iteration's figures under today's names."""
    return {RENAMED_METRICS.get(name, name): value for name, value in line.items()}


def refuse_old_flags(words: Sequence[str], table: Table = RENAMED) -> None:
    """Raise ConfigError for the first flag with an old name, which names today's flag."""
    flags = {flag(old): new for old, new in table.items()}
    for word in words:
        name = word.partition("=")[0].replace("_", "-")
        # tyro turns a true-or-false setting off by --no-NAME in its last part
        plain = (
            name.replace("no-", "", 1) if name.startswith("--no-") else name.replace(".no-", ".")
        )
        if name not in flags and plain not in flags:
            continue
        new = flags[name if name in flags else plain]
        if new is None:
            raise ConfigError(f"{name} no longer exists: leave it out")
        today = flag(new.key if isinstance(new, Converted) else new)
        raise ConfigError(f"{name} is now {today}: use that")


def refuse_repeated_flags(words: Sequence[str]) -> None:
    """Raise ConfigError for a flag whose setting another flag of `train` sets, and name that."""
    today = {flag(key): other for key, other in REPEATED.items()}
    for word in words:
        typed = word.partition("=")[0]
        if typed.replace("_", "-") in today:
            raise ConfigError(f"{typed} is set by {today[typed.replace('_', '-')]}: use that")


def flag(key: str) -> str:
    """Return the command-line flag of a dotted setting."""
    return "--" + key.replace("_", "-")


def _holds(tree: Mapping[str, Any], key: str) -> bool:
    try:
        *_, (parent, name) = _path(tree, key)
    except (KeyError, TypeError):
        return False
    return isinstance(parent, dict) and name in parent


def _path(tree: Mapping[str, Any], key: str) -> Iterator[tuple[Any, str]]:
    """Yield each group on the path to a setting, with the key of the next."""
    here: Any = tree
    names = key.split(".")
    for index, name in enumerate(names):
        yield here, name
        if index < len(names) - 1:
            here = here[name]


def _take(tree: dict[str, Any], key: str) -> Any:
    """Remove a setting and return its value; groups left empty go with it."""
    path = list(_path(tree, key))
    parent, name = path[-1]
    value = parent.pop(name)
    for group, member in reversed(path[:-1]):
        if group[member]:
            break
        del group[member]
    return value


def _put(tree: dict[str, Any], key: str, value: Any) -> None:
    *groups, name = key.split(".")
    here = tree
    for group in groups:
        here = here.setdefault(group, {})
    here[name] = value

"""Recipes: schedules of a training in stages, read from TOML files, and the settings of each stage.

The package's recipes are in `console/run/data`, one a task: NAME-TASK.toml.
"""

import re
import shlex
import tomllib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any

from console.run.experiment import (
    PRESETS,
    Experiment,
    experiment_from_json,
    from_json,
    to_json,
)
from console.run.stages import Before, Stage
from learner.stages import ALL, StageEnd
from world.config import WorldConfig
from world.errors import ChoiceError, ConfigError

SUFFIX = ".toml"
#: Settings that are one for all stages: what the networks and their inputs are, and which data
#: there are.
_THROUGHOUT = (
    "ppo.hidden", "ppo.skip", "ppo.observation_clip", "ppo.observation_std_floor", "ppo.threads",
    # where a training begins: from there on KL adapts the one and counts the other down
    "ppo.actor_rate", "ppo.warmup_iterations",
    "world.task", "world.motions", "world.objects", "world.action_scale", "world.action_clip",
    "style.hidden", "style.replay", "style.object_features", "style.window", "style.mask_holding",
    "style.normaliser_samples",
)  # fmt: skip
_STAGE_GROUPS = ("world.", "ppo.", "style.", "horizon")
#: Setting of a stage that has a task of its own, which is learned before the run's.
TASK = "world.task"
#: From the seed of one stage to that of the next, so that no two repeat each other's draws.
_SEEDS_APART = 1_000_003


@dataclass(frozen=True)
class Recipe:
    """A recipe as it is read: the settings of the run, and its stages."""

    name: str
    preset: str
    settings: dict[str, Any]
    """By dotted name, as in an experiment's JSON."""
    stages: tuple[Stage, ...]
    before: tuple[Before, ...] = ()


def names(task: str = "") -> list[str]:
    """Return the names of the package's recipes, for a task or for any."""
    found = [item.name.removesuffix(SUFFIX) for item in _folder().iterdir()]
    parts = [name.rpartition("-") for name in found]
    return sorted({name for name, _, of in parts if name and task in ("", of)})


def find(name: str, task: str) -> Recipe:
    """Return the recipe of a name for a task, or of a path ending in .toml.

    Raises ChoiceError for an unknown name, ConfigError for an invalid file.
    """
    if name.endswith(SUFFIX):
        path = Path(name)
        if not path.is_file():
            raise ConfigError(f"--recipe {name}: no such file")
        return parsed(path.read_bytes(), name, task=task)
    if name not in names(task):
        raise ChoiceError("--recipe", name, [*names(task), "a file ending in .toml"])
    file = f"{name}-{task}{SUFFIX}"
    return parsed((_folder() / file).read_bytes(), name, file, task)


def _folder() -> Any:
    return resources.files("console.run") / "data"


def parsed(content: bytes, name: str, where: str = "", task: str = "") -> Recipe:
    """Return the recipe of a TOML file. Raises ConfigError, which names the file and the entry.

    task: whose recipe of the package one with `extends` has the preset, stages and further settings
    of.
    """
    where = where or name
    try:
        document = tomllib.loads(content.decode())
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ConfigError(f"{where}: not valid TOML ({error})") from error
    if "extends" in document:
        _only(document, {"extends", "settings"}, where)
        extended = str(document["extends"])
        if extended not in names(task) or extended == name:
            others = ", ".join(other for other in names(task) if other != name)
            raise ConfigError(f"{where}: extends {extended!r}; choose {others}")
        base = find(extended, task)
        own = base.settings | _settings(document.get("settings", {}), where)
        with_settings(PRESETS[base.preset], own, where)
        return replace(base, name=name, settings=own)
    _only(document, {"preset", "settings", "before", "stage"}, where)
    preset, stages = document.get("preset", "fast"), document.get("stage", [])
    if preset not in PRESETS:
        raise ConfigError(f"{where}: preset {preset!r}; choose {', '.join(PRESETS)}")
    if not isinstance(stages, list) or not stages:
        raise ConfigError(f"{where}: has no [[stage]]")
    settings = _settings(document.get("settings", {}), where)
    before = _before(document.get("before", []), where)
    found = Recipe(name, preset, settings, tuple(_stage(s, where) for s in stages), before)
    last = found.stages[-1]
    if task and (other := last.settings.get(TASK, task)) != task:
        raise ConfigError(f"{where}: stage {last.name}: task {other}; the last one is of {task}")
    base = with_settings(PRESETS[preset], found.settings, where)
    for stage in found.stages:  # a wrong setting is refused at once, not hours later
        with_settings(base, stage.settings, f"{where}: stage {stage.name}")
    return found


def _before(entries: Any, where: str) -> tuple[Before, ...]:
    """The runs before that of the recipe. Raises ConfigError for one that is not a training or
    that names another one than those before it."""
    found: list[Before] = []
    if not isinstance(entries, list):
        raise ConfigError(f"{where}: [[before]] must be a list of tables")
    for entry in entries:
        _only(entry, {"name", "command", "about", "clips"}, f"{where}: [[before]]")
        one = from_json(Before, {"name": "", "command": ""} | entry, f"{where}: [[before]]")
        here, known = f"{where}: before {one.name or '?'}", [other.name for other in found]
        if not re.fullmatch(r"[a-z0-9-]+", one.name) or one.name in known:
            raise ConfigError(f"{here}: needs a name of its own: a-z, 0-9 and -")
        try:
            words = shlex.split(one.command)
        except ValueError as error:
            raise ConfigError(f"{here}: command: {error}") from None
        if len(words) < 2 or words[0] not in ("train", "distill"):
            raise ConfigError(f"{here}: command: begins with train TASK or distill TASK")
        for flag in ("--run", "--resume", "--restart", "--replace", "--motions"):
            if any(word.partition("=")[0] == flag for word in words):
                raise ConfigError(f"{here}: command: {flag} is of the recipe's run: leave it out")
        for other in re.findall(r"{(.*?)}", one.command):
            if other not in known:
                said = f"choose {', '.join(known)}" if known else "it is the first"
                raise ConfigError(f"{here}: command: no run {{{other}}} before it; {said}")
        found.append(one)
    return tuple(found)


def _stage(entry: Any, where: str) -> Stage:
    _only(entry, {"name", "about", "task", "settings", "ends"}, f"{where}: [[stage]]")
    name = str(entry.get("name", ""))
    here = f"{where}: stage {name or '?'}"
    ends = entry.get("ends", {})
    _only(ends, {"success", "episodes", "at-least", "limit"}, f"{here}: ends")
    success, limit = ends.get("success", {}), ends.get("limit", 0)
    if not name or not isinstance(success, dict) or not success or not limit:
        raise ConfigError(f"{here}: needs a name, ends.success and ends.limit")
    numbers = (limit, ends.get("episodes", 2048), ends.get("at-least", 0), *success.values())
    if not all(isinstance(n, int | float) and n >= 0 for n in numbers):
        raise ConfigError(f"{here}: ends: episodes, at-least, limit and rates are numbers from 0")
    if max(success.values()) > 1.0:
        raise ConfigError(f"{here}: ends.success: rates are from 0 to 1")
    settings = _settings(entry.get("settings", {}), here)
    for key in settings:
        if not key.startswith(_STAGE_GROUPS) or key in _THROUGHOUT:
            raise ConfigError(f"{here}: {_typed(key)} is one for all stages: put it in [settings]")
    if "task" in entry:
        settings = {TASK: _goal_task(entry["task"], here)} | settings
    return Stage(
        name,
        str(entry.get("about", "")),
        settings,
        {str(kind): float(rate) for kind, rate in success.items()},
        int(ends.get("episodes", 2048)),
        int(ends.get("at-least", 0)),
        int(limit),
    )


def _goal_task(name: Any, where: str) -> str:
    """The name of a task that a stage may have: each but those that follow clips, whose settings
    are others."""
    from world import tasks  # takes a second, which most commands need not wait

    known = [task for task in tasks.REGISTRY if not tasks.make(task).affordance.follows_clips]
    if name not in known:
        raise ConfigError(f"{where}: task {name!r}; choose {', '.join(known)}")
    return name


def _only(entry: Any, known: Collection[str], where: str) -> None:
    if not isinstance(entry, dict):
        raise ConfigError(f"{where}: must be a table")
    if unknown := sorted(set(entry) - set(known)):
        raise ConfigError(f"{where}: unknown {', '.join(unknown)}; known: {', '.join(known)}")


def _settings(entry: Any, where: str) -> dict[str, Any]:
    if not isinstance(entry, dict) or any(isinstance(v, dict) for v in entry.values()):
        raise ConfigError(f'{where}: name settings as flags, in quotes: "ppo.gamma" = 0.99')
    return {key.replace("-", "_"): value for key, value in entry.items()}


def _typed(key: str) -> str:
    return key.replace("_", "-")


def with_settings(
    experiment: Experiment, settings: Mapping[str, Any], where: str = "recipe"
) -> Experiment:
    """Return an experiment with settings by dotted name. Raises ConfigError, which names one that
    does not exist or has another type."""
    document = to_json(experiment)
    for key, value in settings.items():
        *groups, last = key.split(".")
        here: Any = document
        for group in groups:
            here = here.get(group) if isinstance(here, dict) else None
        if not isinstance(here, dict) or last not in here or isinstance(here[last], dict):
            raise ConfigError(f"{where}: there is no setting {_typed(key)}")
        here[last] = value
    try:
        return experiment_from_json(document, where)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"{where}: {error}") from error


def start(recipe: Recipe, explicit: Collection[str]) -> tuple[Experiment, tuple[str, ...]]:
    """Return the settings that a run of a recipe begins with, and a line on each setting of its
    that an explicit one overrides.

    explicit: dotted names of the settings that the command line has, which hold in all stages.
    """
    base = with_settings(PRESETS[recipe.preset], recipe.settings, recipe.name)
    lines = []
    for key in sorted(explicit):
        numbers = [str(k) for k, stage in enumerate(recipe.stages, 1) if key in stage.settings]
        own = ["settings"] if key in recipe.settings else []
        if places := own + [f"stage {', '.join(numbers)}"] * bool(numbers):
            where = " and ".join(places)
            lines.append(f"--{_typed(key)} overrides the recipe {recipe.name}: {where}")
    stages = tuple(
        replace(stage, settings={k: v for k, v in stage.settings.items() if k not in explicit})
        for stage in recipe.stages
    )
    return replace(base, before=recipe.before, stages=stages), tuple(lines)


def explicit_settings(words: Sequence[str]) -> set[str]:
    """Return the dotted names of the settings in the words of a command line."""
    found = set()
    for word in words:
        if word.startswith("--"):
            *groups, last = word.partition("=")[0][2:].split(".")
            found.add(".".join([*groups, last.removeprefix("no-")]).replace("-", "_"))
    return found


def staged(experiment: Experiment, number: int) -> Experiment:
    """Return the settings of the stage `number`, from 1; without stages those of the run.

    A stage of another task has that task's furniture.
    """
    if not experiment.stages:
        return experiment
    seed = (experiment.seed + _SEEDS_APART * (number - 1)) % 2**63
    stage = experiment.stages[number - 1]
    found = with_settings(experiment, stage.settings, f"stage {stage.name}")
    if found.world.task != experiment.world.task:
        found = replace(found, world=_furnished(found.world))
    return replace(found, seed=seed)


def _furnished(world: WorldConfig) -> WorldConfig:
    """The settings with the objects of their task, where they are not those of the run's."""
    from world import tasks

    affordance = tasks.make(world.task).affordance
    objects = () if "objects" in affordance.unused else world.objects
    return replace(world, classes=affordance.classes, objects=objects)


def stage_end(experiment: Experiment, number: int, kinds: Sequence[str]) -> StageEnd | None:
    """Return the end of a stage; None without stages. kinds: categories of initial states.

    Raises ConfigError for a condition on a category that the task does not have.
    """
    if not experiment.stages:
        return None
    stage = experiment.stages[number - 1]
    if unknown := sorted(set(stage.success) - {*kinds, ALL}):
        known = ", ".join([*kinds, ALL])
        raise ConfigError(f"stage {stage.name}: success of {', '.join(unknown)}; choose {known}")
    return StageEnd(number, stage.success, stage.episodes, stage.at_least, stage.limit)


def condition(stage: Stage) -> str:
    """Return the condition of a stage in words, as in `near >= 0.40, far >= 0.25`."""
    return ", ".join(f"{kind} >= {rate:.2f}" for kind, rate in stage.success.items())


def shown(value: Any) -> str:
    """Return a setting's value as text, as in `0 0.05, 6e+06 0.035` of a schedule."""
    if isinstance(value, list):
        apart = ", " if any(isinstance(item, list) for item in value) else " "
        return apart.join(map(shown, value))
    if isinstance(value, int | float) and not isinstance(value, bool):
        return f"{value:g}"
    return str(value)

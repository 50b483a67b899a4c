"""One experiment: everything that decides its numbers, as JSON and back, and what changed."""

import dataclasses
import types
import typing
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from console.run.directory import RunDirectory, RunError
from discriminator.config import StyleConfig
from learner.config import LearnerConfig
from world.config import StartMixture, WorldConfig
from world.errors import ConfigError


@dataclass(frozen=True)
class Experiment:
    """What is learned, where, and with which settings; the numbers follow from this alone."""

    seed: int = 0
    """Of everything that is random."""
    scenes: int = 512
    """Scenes simulated at once, over all actors."""
    horizon: int = 8
    """Control steps of each scene in one iteration."""
    block: int = 64
    """Scenes that one inference takes; actors own whole blocks."""
    device: Literal["auto", "cpu"] = "auto"
    """Where the networks train; auto: the CPU, which is all that is built so far."""
    simulator: Literal["mujoco"] = "mujoco"
    """What steps the scenes."""
    overlap: bool = False
    """Actors act while the learner learns, by a policy one update old; for clusters."""
    max_policy_lag: int = 1
    """Samples by a policy older than so many updates are dropped and counted."""
    max_style_lag: int = 1
    """Likewise samples scored by a discriminator so many trainings behind."""
    clone_passes: int = 8
    """Passes of regression on the clips before the first iteration; 0: start from nothing."""
    clone_samples: int = 40_000
    """Clip states of that regression, each noised."""
    world: WorldConfig = field(default_factory=WorldConfig)
    ppo: LearnerConfig = field(default_factory=LearnerConfig)
    style: StyleConfig = field(default_factory=StyleConfig)


PRESETS: dict[str, Experiment] = {
    # The recipe of docs/recipe.md: measured in pieces, not yet run from start to end.
    "fast": Experiment(
        world=WorldConfig(
            starts=StartMixture(clip=0.3, near=0.4, far=0.3),
            clip_stages=(0.25, 0.6, 0.15),
            standing=0.3,
            front=0.7,
        ),
        ppo=LearnerConfig(
            sigma=((0.0, 0.05), (6e6, 0.035), (34e6, 0.035), (40e6, 0.024)),
            clip=((34e6, 0.3), (40e6, 0.2)),
            kl_target=((34e6, 0.08), (40e6, 0.04)),
            observation_clip=10.0,
            warmup_iterations=15,
        ),
        style=StyleConfig(gradient_penalty=8.0),
    ),
    # Motion tracking: the task reward alone, short episodes, nothing to clone.
    "track": Experiment(
        scenes=256,
        horizon=32,
        clone_passes=0,
        ppo=LearnerConfig(
            sigma=((0.0, 0.05),),
            task_weight=1.0,
            style_weight=0.0,
            gamma=0.97,
            kl_target=((0.0, 0.03),),
            clip=((0.0, 0.2),),
            observation_clip=10.0,
            warmup_iterations=5,
        ),
    ),
    # method.md's numbers, where a machine without 4096 scenes can take them: batch and rates stay.
    "paper": Experiment(
        ppo=LearnerConfig(
            hidden=(1024, 512),
            task_weight=0.5,
            style_weight=0.5,
            gamma=0.99,
            clip=((0.0, 0.2),),
            warmup_iterations=20,
        ),
        style=StyleConfig(hidden=(1024, 512)),
    ),
}


def to_json(value: Any) -> Any:
    """Nested dataclasses, tuples and paths as JSON values."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: to_json(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, tuple | list):
        return [to_json(item) for item in value]
    if isinstance(value, dict):
        return {str(key): to_json(item) for key, item in value.items()}
    if isinstance(value, Path):
        return str(value)
    return value


def from_json(kind: Any, value: Any, where: str = "config") -> Any:
    """The inverse of `to_json` for a type; a field that is missing keeps its default.

    Raises ConfigError for a field that the type does not have: it would be lost silently.
    """
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        hints = typing.get_type_hints(kind)
        unknown = sorted(set(value) - set(hints))
        if unknown:
            raise ConfigError(f"{where} holds unknown settings: {', '.join(unknown)}")
        return kind(**{k: from_json(hints[k], v, f"{where}.{k}") for k, v in value.items()})
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        if value is None:
            return None
        return from_json(next(a for a in arguments if a is not type(None)), value, where)
    if origin is tuple:
        each = arguments[:1] * len(value) if arguments[-1] is Ellipsis else arguments
        return tuple(from_json(a, v, where) for a, v in zip(each, value, strict=True))
    if origin is dict:
        return {k: from_json(arguments[1], v, where) for k, v in value.items()}
    return Path(value) if kind is Path else float(value) if kind is float else value


def differences(old: Any, new: Any, where: str = "") -> Iterator[str]:
    """One line a setting that differs between two JSON values: `ppo.gamma: 0.98 -> 0.99`."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted(set(old) | set(new)):
            name = f"{where}.{key}" if where else key
            yield from differences(old.get(key), new.get(key), name)
    elif old != new:
        yield f"{where}: {old} -> {new}"


def read_task(run: RunDirectory) -> str:
    """The task of a run."""
    task = run.read_config().get("task")
    if not isinstance(task, str):
        raise RunError(f"{run.config} names no task: restore it")
    return task


def read_experiment(run: RunDirectory) -> Experiment:
    """The experiment of a run."""
    try:
        return from_json(Experiment, run.read_config()["experiment"], str(run.config))
    except (KeyError, TypeError, ValueError) as error:
        raise RunError(f"{run.config} is not a run's configuration ({error})") from error


def check(experiment: Experiment) -> Experiment:
    """The experiment, or ConfigError where its settings contradict one another."""
    if experiment.scenes <= 0 or experiment.horizon <= 0 or experiment.block <= 0:
        raise ConfigError("scenes, horizon and block must be above 0")
    if experiment.scenes % experiment.block:
        raise ConfigError(
            f"--scenes {experiment.scenes} is no multiple of --block {experiment.block}: choose "
            f"{max(1, round(experiment.scenes / experiment.block)) * experiment.block}"
        )
    if min(experiment.max_policy_lag, experiment.max_style_lag) < 0:
        raise ConfigError("--max-policy-lag and --max-style-lag must be 0 or above")
    if experiment.overlap and experiment.max_policy_lag < 1:
        raise ConfigError(
            "--overlap learns from a policy one update old, --max-policy-lag 0 drops every such"
            " sample: leave one of them out"
        )
    return experiment


def with_learner_threads(experiment: Experiment, threads: int) -> Experiment:
    """The same numbers on so many threads of the update."""
    return replace(experiment, ppo=replace(experiment.ppo, threads=min(2, threads)))

"""One experiment: all settings that decide its numbers, their JSON, and differences of two."""

import dataclasses
import types
import typing
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from console.run.directory import RunDirectory, RunError
from console.run.renamed import current
from console.run.stages import Before, Stage
from discriminator.config import StyleConfig
from learner.config import LagConfig, LearnerConfig
from world.config import InitialStates, WorldConfig
from world.errors import ConfigError
from world.refusals import refusing
from world.scene.warp_config import WarpConfig


@dataclass(frozen=True)
class Experiment:
    """All settings that decide the numbers of a training."""

    seed: int = 0
    """Seed of all random draws."""
    mix: tuple[str, ...] = ()
    """Tasks that share scenes and one policy, TASK=SHARE each. As in track=0.5 carry=0.5; empty:
    the trained task alone."""
    scenes: int = 512
    """Scenes that are simulated at once, over all actors."""
    horizon: int = 8
    """Control steps of each scene in one iteration."""
    block: int = 64
    """Scenes in one inference; an actor owns whole blocks."""
    device: Literal["auto", "cpu", "cuda"] = "auto"
    """Device of networks and replay in training. auto: a GPU where there is one."""
    simulator: Literal["mujoco", "warp"] = "mujoco"
    """Simulator that steps the scenes. mujoco: on the cores of the CPU; warp: mujoco-warp, all
    scenes on the device (an extra of the package)."""
    warp: WarpConfig = field(default_factory=WarpConfig)
    """Arrays of mujoco-warp."""
    clone_passes: int = 8
    """Epochs of behaviour cloning on the clips before the first iteration; 0: none."""
    clone_samples: int = 40_000
    """Number of clip states in the behaviour cloning, each with noise."""
    lag: LagConfig = field(default_factory=LagConfig)
    """Overlap of acting and learning, and the greatest age of the samples of an update."""
    before: tuple[Before, ...] = ()
    """Runs of a recipe that are made before this one, which begins from the last."""
    stages: tuple[Stage, ...] = ()
    """Stages of a recipe, one after the other; empty: the settings hold throughout."""
    world: WorldConfig = field(default_factory=WorldConfig)
    ppo: LearnerConfig = field(default_factory=LearnerConfig)
    style: StyleConfig = field(default_factory=StyleConfig)


PRESETS: dict[str, Experiment] = {
    # The recipe of docs/how-to/recipes/sit.md: its parts are measured, the whole is not yet run.
    "fast": Experiment(
        world=WorldConfig(
            held_out=False,
            initial=InitialStates(
                reference=0.3,
                near=0.4,
                far=0.3,
                reference_stages=(0.25, 0.6, 0.15),
                standing_fraction=0.3,
                front_fraction=0.7,
            ),
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
    # Motion tracking: the task reward alone, short episodes, no behaviour cloning.
    "track": Experiment(
        scenes=256,
        horizon=32,
        clone_passes=0,
        world=WorldConfig(held_out=False),
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
    # To go on from a policy that can already do the task, of `distill` or of another run: little
    # noise, small steps, long rollouts (docs/lab-notes/sit.md, "From 76 to 82 %").
    "finetune": Experiment(
        horizon=32,
        clone_passes=0,
        world=WorldConfig(
            held_out=False,
            initial=InitialStates(
                reference=0.12,
                near=0.44,
                far=0.44,
                raised_seat_fraction=0.5,
                standing_fraction=0.5,
                near_m=(0.5, 1.7),
                front_fraction=0.2,
                front_m=(0.35, 1.3),
                ahead_fraction=0.3,
            ),
        ),
        ppo=LearnerConfig(
            sigma=((0.0, 0.025),),
            gamma=0.99,
            minibatch=4096,
            epochs=4,
            clip=((0.0, 0.2),),
            kl_target=((0.0, 0.04),),
            actor_rate=6e-5,
            observation_clip=10.0,
            mirror_weight=0.005,
            warmup_iterations=20,
        ),
        style=StyleConfig(gradient_penalty=8.0, steps_per_iteration=4, throttle=0.9),
    ),
    # The paper's numbers; batch and rates stay, as a machine without 4096 scenes cannot take them.
    "paper": Experiment(
        world=WorldConfig(held_out=False),
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
    """Return nested dataclasses, tuples and paths as JSON values."""
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
    """Return a value of a type from its JSON, as written by `to_json`; missing fields keep their
    defaults.

    Raises ConfigError for a field that the type lacks, which would be lost silently.
    """
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        hints = typing.get_type_hints(kind)
        unknown = sorted(set(value) - set(hints))
        if unknown:
            raise ConfigError(f"{where} holds unknown settings: {', '.join(unknown)}")
        return kind(**{k: from_json(hints[k], v, f"{where}.{k}") for k, v in value.items()})
    if kind is Any:
        return value
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
    if kind is float and type(value) in (int, float):
        return float(value)
    if kind is Path and isinstance(value, str):
        return Path(value)
    fits = value in arguments if origin is Literal else type(value) is kind
    if not fits:
        words = ", ".join(map(str, arguments)) if origin is Literal else kind.__name__
        raise ConfigError(f"{where}: {str(value)[:40]!r}, must be {words}")
    return value


def experiment_from_json(value: dict[str, Any], where: str = "config") -> Experiment:
    """Return an experiment from its JSON of this or an earlier version (`RENAMED`)."""
    return from_json(Experiment, current(value), where)


def differences(old: Any, new: Any, where: str = "") -> Iterator[str]:
    """Yield one line per setting that differs in two JSON values: `ppo.gamma: 0.98 -> 0.99`."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted(set(old) | set(new)):
            name = f"{where}.{key}" if where else key
            yield from differences(old.get(key), new.get(key), name)
    elif old != new:
        yield f"{where}: {old} -> {new}"


def read_experiment(run: RunDirectory) -> Experiment:
    """Return the experiment of a run; RunError for an invalid config.json."""
    config = run.read_config()
    with refusing(RunError, run.config, "run's configuration"):
        if not isinstance(config, dict) or not isinstance(config.get("experiment"), dict):
            raise RunError(f"{run.config} is not a run's configuration: it has no experiment")
        return experiment_from_json(config["experiment"], str(run.config))


def check(experiment: Experiment) -> Experiment:
    """Return the experiment; ConfigError where its settings contradict one another."""
    if experiment.scenes <= 0 or experiment.horizon <= 0 or experiment.block <= 0:
        raise ConfigError("--scenes, --horizon and --block must be above 0")
    if experiment.scenes % experiment.block:
        raise ConfigError(
            f"--scenes {experiment.scenes} is not a multiple of --block {experiment.block}: choose "
            f"{max(1, round(experiment.scenes / experiment.block)) * experiment.block}"
        )
    if min(experiment.warp.nconmax, experiment.warp.njmax) <= 0:
        raise ConfigError("--warp.nconmax and --warp.njmax must be above 0")
    initial = experiment.world.initial
    if initial.reference + initial.near + initial.far <= 0.0:
        raise ConfigError(
            "--world.initial.reference, --world.initial.near and --world.initial.far are all 0:"
            " episodes need an initial state of some kind"
        )
    if sum(initial.reference_stages) <= 0.0:
        raise ConfigError("--world.initial.reference-stages: one of them must be above 0")
    lag = experiment.lag
    if min(lag.max_policy, lag.max_style) < 0:
        raise ConfigError("--lag.max-policy and --lag.max-style must be 0 or above")
    if lag.overlap and lag.max_policy < 1:
        raise ConfigError(
            "--lag.overlap gives samples of a policy one update old, which --lag.max-policy 0"
            " drops: leave one of them out"
        )
    # imported here: all flags need this module, and the episodes compile the character
    from world.episodes import disturbances

    track = experiment.world.track
    if track.teacher and not track.goal:
        raise ConfigError(
            f"--world.track.teacher {track.teacher}: a tracker teaches what does not see the"
            " reference: add --world.track.goal TASK"
        )
    for flag, named in (
        ("track.teacher", track.teacher),
        ("walker", experiment.world.walker),
        ("tracker", experiment.world.tracker),
        ("expert", experiment.world.expert),
    ):
        if named and experiment.ppo.imitation_weight <= 0.0:
            raise ConfigError(
                f"--world.{flag} {named} teaches nothing at --ppo.imitation-weight 0: raise it,"
                " for instance to 0.1"
            )
    disturbances.check(experiment.world, experiment.simulator)
    return experiment


def with_learner_threads(experiment: Experiment, threads: int) -> Experiment:
    """Return the experiment with a number of threads of the update; its numbers do not change."""
    return replace(experiment, ppo=replace(experiment.ppo, threads=min(2, threads)))

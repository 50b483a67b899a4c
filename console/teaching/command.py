"""`inhabit teach`: checks and runs its commands."""

import json
from dataclasses import dataclass, replace
from pathlib import Path

import torch

from console.commands.teaching import Practice, TeachCarry, TeachRecord, TeachTry
from console.evaluation.trials import require_distances
from console.run import ancestors, assembly
from console.run.directory import checkpoint_folder
from console.run.experiment import Experiment, to_json
from console.serving.publish import require_published
from console.teaching import dagger, recording, trials
from console.teaching.scenes import TeachingScenes
from learner.config import LearnerConfig
from learner.ppo import Learner
from policy.checkpoints import lineage
from policy.checkpoints.format import read
from policy.checkpoints.lineage import Origin
from policy.checkpoints.transfer import widened
from world.config import WorldConfig
from world.errors import ConfigError
from world.tasks.carry import Carry

_TEACHER = Origin("a scripted teacher (world.teachers.scripted), no motion capture", "Apache-2.0")


@dataclass(frozen=True)
class MakeScenes:
    """Factory of one worker's scenes; can be pickled."""

    practice: Practice
    world: WorldConfig

    def __call__(self) -> TeachingScenes:
        return TeachingScenes(self.practice, self.world)


def teach_command(command: TeachCarry) -> int:
    """Train a student of the scripted teacher."""
    if not command.dagger.hidden:
        raise ConfigError("--hidden must be one width or more")
    require_free(command.out, command.replace)
    if command.practice.walker is not None:
        _carry_policy(command.practice.walker)
    torch.set_num_threads(1)
    experiment = experiment_of(command)
    seed, world = command.practice.seed, experiment.world
    scenes = [
        MakeScenes(replace(command.practice, seed=seed + 1000 * k), world)
        for k in range(command.dagger.workers)
    ]
    origins = ancestors.origins((command.init, command.practice.walker))
    notes = {
        "experiment": json.dumps(to_json(experiment)),
        lineage.NOTE: lineage.note((_TEACHER, *origins)),
    }
    student = initialised(command, experiment)
    lesson = dagger.Lesson(
        scenes, experiment, student, command.init is not None, Carry.stages, notes
    )
    dagger.teach(command.out, command.dagger, lesson)
    return 0


def require_free(out: Path, replace: bool) -> None:
    """Raise ConfigError where a folder exists without `replace` or is no checkpoint.

    Raises RunError where it holds other files, which would be lost.
    """
    if not out.exists():
        return
    if not (out / "manifest.json").exists():
        raise ConfigError(f"{out} exists and is not a checkpoint: choose another folder")
    if not replace:
        raise ConfigError(f"{out} exists: add --replace, or name another folder")
    require_published(out)


def experiment_of(command: TeachCarry) -> Experiment:
    """Return the experiment of the checkpoint."""
    world = WorldConfig(task="carry", episode_s=Carry.episode_s)
    ppo = LearnerConfig(hidden=command.dagger.hidden, skip=True, observation_clip=10.0)
    return Experiment(seed=command.practice.seed, world=world, ppo=ppo)


def initialised(command: TeachCarry, experiment: Experiment) -> Learner:
    """Return the initial learner: new, or with the networks of `init`."""
    learner = assembly.learner(experiment)
    if command.init is not None:
        found = read(checkpoint_folder(command.init), ("policy",))
        mine, theirs = assembly.layout(experiment), found.manifest.layout
        source = f"--init {command.init}"
        if theirs.task != mine.task:
            raise ConfigError(f"{source} is a policy of {theirs.task}: choose one of {mine.task}")
        if not theirs.skip:
            raise ConfigError(
                f"{source}: its actor has no linear map beside its layers, as a student of this"
                " teacher has: choose a checkpoint of inhabit teach carry"
            )
        replace(mine, hidden=theirs.hidden).require(theirs, source)
        policy = widened(found.state["policy"], command.dagger.hidden, experiment.seed, source)
        learner.load_policy_state({**policy, "actor": policy["average"]})
    return learner


def try_command(command: TeachTry) -> int:
    """Evaluate the scripted teacher and print its figures."""
    require_distances(command.near_m, command.far_m)
    torch.set_num_threads(1)
    figures = trials.evaluate_teacher(command)
    if command.json:
        print(json.dumps(figures, indent=1))
        return 0
    for name in ("success", "sustained", "falls", "time_s", "precision_m"):
        print(name, figures[name])
    for part in figures["by_stage"]:
        print(part["stage"], part["rate"])
    return 0


def record_command(command: TeachRecord) -> int:
    """Record clips of the scripted teacher."""
    torch.set_num_threads(1)
    recording.record(command)
    return 0


def _carry_policy(path: Path) -> None:
    found = assembly.trained(path)
    if found.task != Carry.name:
        raise ConfigError(
            f"--walker {path} is a policy of {found.task}: choose one of {Carry.name}"
        )

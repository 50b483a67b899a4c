"""What a training begins from: its checkpoint, the networks of another run, or the clips."""

import contextlib
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch

from console.commands import Train
from console.run import ancestors, assembly, mixing
from console.run.directory import RunDirectory, RunError
from console.run.experiment import Experiment, differences, experiment_from_json, to_json
from console.run.metrics import truncate_metrics
from console.run.recipe import staged
from console.terminal import doing
from learner.cloning import clone
from learner.loop import Loop
from learner.ppo import Learner
from policy.checkpoints import lineage
from policy.checkpoints.format import Checkpoint, Layout, Manifest, read_manifest
from policy.checkpoints.lineage import Origin
from policy.checkpoints.numbering import numbered
from policy.checkpoints.run_checkpoints import read_newest
from policy.errors import CheckpointError
from world import device as devices
from world.character.features import STATE
from world.episodes.cloning import pairs

#: Note of a checkpoint: the number of the stage that it is in.
STAGE = "stage"


def require_unedited(manifest: Manifest, experiment: Experiment, run: RunDirectory) -> None:
    """Raise RunError, with the differences, where config.json differs from the settings of a
    checkpoint."""
    noted = manifest.notes.get("experiment")
    if noted is None:
        return  # checkpoints of earlier versions record no experiment
    trained = experiment_from_json(json.loads(noted), f"{run.path}'s checkpoint")
    own = _settings(experiment, manifest)
    changed = list(differences(recorded(trained), recorded(own)))
    if changed:
        raise RunError(
            f"{run.config} was changed since the checkpoint was written: {'; '.join(changed)}"
            " (restore the former values, or start another run with --init)"
        )


def _settings(experiment: Experiment, manifest: Manifest) -> Experiment:
    """The settings of the stage that a checkpoint notes: of the first where it notes none, of the
    last where there are fewer."""
    noted = manifest.notes.get(STAGE, "1")
    number = int(noted) if noted.isdecimal() else 1
    return staged(experiment, max(1, min(number, len(experiment.stages))))


def recorded(experiment: Experiment) -> dict[str, Any]:
    """Return the settings in config.json, which --resume compares: all that numbers depend on."""
    config = to_json(experiment)
    config["ppo"].pop("threads")
    return config


def newest(run: RunDirectory, experiment: Experiment, note: Callable[[str], None]) -> Checkpoint:
    """Return the newest readable checkpoint of a run that resumes; a line on each damaged one."""

    def layout(manifest: Manifest) -> Layout:
        return assembly.layout(_settings(experiment, manifest))

    found, damaged = read_newest(run.checkpoints, layout)
    for line in damaged:
        note(line)
    require_unedited(found.manifest, experiment, run)
    return found


def stage_of(found: Checkpoint) -> int:
    """Return the number of the stage that a checkpoint is in, from 1; 1 without stages."""
    return int(found.state["training"].get(STAGE, {}).get("number", 1))


def inherited(run: RunDirectory, command: Train, experiment: Experiment) -> tuple[Origin, ...]:
    """Return the origins of the weights that a training begins from, and in any of its stages of
    its teachers', and of the clips of other tasks: those of --init and of the settings, or those
    that the run's newest readable checkpoint names."""
    if not command.resume:
        named: list[Path | str | None] = [command.init]
        clips: list[Origin] = []
        for number in range(1, len(experiment.stages) + 1) or (1,):
            settings = staged(experiment, number)
            world, track = settings.world, settings.world.track
            named += [track.teacher, track.walker, track.rollouts]
            named += [world.walker, world.tracker, world.expert]
            if world.task != experiment.world.task:
                clips += assembly.origins(settings)
        return tuple(dict.fromkeys((*ancestors.origins(dict.fromkeys(named)), *clips)))
    for path in reversed(numbered(run.checkpoints)):
        with contextlib.suppress(CheckpointError):
            notes = read_manifest(path).notes
            return lineage.of(notes) if lineage.NOTE in notes else ()
    return ()


def initialise(
    loop: Loop,
    run: RunDirectory,
    command: Train,
    experiment: Experiment,
    note: Callable[[str], None],
    resumed: Checkpoint | None = None,
) -> None:
    """Initialise the loop from the checkpoint that the run resumes from, another run's networks, or
    behaviour cloning."""
    learner = loop.learner
    if resumed is not None:
        with doing("restoring the checkpoint"):
            loop.load_state_dict(resumed.state)
        dropped = truncate_metrics(run.metrics, learner.version)
        lines = f", {dropped} lines of metrics dropped" if dropped else ""
        note(f"resumed from {resumed.path}{lines}")
    elif command.init:
        with doing("reading the networks to begin from"):
            path, state, task = ancestors.networks(command.init, experiment)
            learner.load_policy_state(state)
        other = "" if task == experiment.world.task else f", of the task {task}"
        note(f"networks and normalisers from {path}{other}")
    elif experiment.clone_passes:
        note(f"behaviour cloning: {experiment.clone_passes} passes over clips")
        began = time.perf_counter()
        with doing("behaviour cloning on the clips"):
            errors = clone_clips(learner, experiment)
        note(
            f"behaviour cloning on the clips: error {errors[0]:.3f} -> {errors[-1]:.3f}"
            f" in {time.perf_counter() - began:.1f} s"
        )


def clone_clips(learner: Learner, experiment: Experiment) -> list[float]:
    """Clone the clips into the learner's actor, with which its average begins; return the mean
    squared error of each epoch."""
    world, seed = experiment.world, experiment.seed
    found = pairs(
        world,
        assembly.library_of(world),
        assembly.training_bank(world),
        experiment.clone_samples,
        seed,
    )
    if (mixed := mixing.mixture_of(experiment)) is not None:
        state, goal = found[0].split((STATE.width, found[0].shape[1] - STATE.width), dim=1)
        found = torch.cat((state, mixed.embed(0, goal)), dim=1), found[1]
    inputs, actions = learner.canonical(*(devices.put(tensor, learner.device) for tensor in found))
    errors = clone(
        learner.actor, learner.normaliser, inputs, actions, experiment.clone_passes, seed=seed
    )
    # else, without a warm-up, the networks as they were drawn would be a part of it for long
    learner.average.load_state_dict(learner.actor.state_dict())
    return errors

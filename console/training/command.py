"""`inhabit train`: creates or resumes a run and trains until a limit or a stop signal."""

import contextlib
import json
import shutil
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import Any

import torch

from console.commands import Train
from console.run import assembly, machine, mixing
from console.run.directory import RunDirectory, RunError, checkpoint_folder, new_run
from console.run.experiment import (
    Experiment,
    check,
    differences,
    experiment_from_json,
    read_experiment,
    to_json,
    with_learner_threads,
)
from console.run.metrics import Recorder, open_recorders, truncate_metrics
from console.run.renamed import flag
from console.terminal import leave_soon
from console.training import dry_run
from console.training.display import Display, Goal, open_display
from console.training.runners import open_runner
from learner.cloning import clone
from learner.config import LoopConfig
from learner.loop import Loop
from learner.ppo import Learner
from policy.checkpoints import lineage
from policy.checkpoints.format import Manifest, read, read_manifest
from policy.checkpoints.lineage import Origin
from policy.checkpoints.run_checkpoints import RunCheckpoints, read_newest
from policy.checkpoints.transfer import adopt
from policy.errors import CheckpointError
from world import device as devices
from world import tasks
from world.character.features import STATE
from world.episodes.cloning import pairs
from world.errors import ConfigError
from world.meshes import collection
from world.scene.simulators import require_warp
from world.tasks.mixture import is_mixed

INTERRUPTED = 130


def train(command: Train) -> int:
    """Run `inhabit train`; return the exit code."""
    experiment = resolve(command)
    if command.dry_run:
        print(dry_run.describe(experiment))
        return 0
    run = RunDirectory(command.run) if command.run else new_run(command.task)
    occupied = run.occupied
    made = [folder for folder in (run.path, *run.path.parents) if not folder.exists()]
    try:
        with run.lock():
            prepare(run, command, experiment)
            return learn(run, command, experiment)
    finally:
        if not occupied:
            remove_unbegun(run, made)


def remove_unbegun(run: RunDirectory, made: Sequence[Path]) -> None:
    """Remove a run in which nothing was trained: no iteration recorded and no checkpoint.

    made: its folders that were not there before, the innermost first; others stay.
    """
    recorded_any = run.metrics.exists() and run.metrics.stat().st_size > 0
    if recorded_any or any(run.checkpoints.glob("[0-9]*")):
        return
    run.erase()
    (run.path / ".lock").unlink(missing_ok=True)
    if run.path in made:
        shutil.rmtree(run.path, ignore_errors=True)
    for folder in made[1:]:
        with contextlib.suppress(OSError):
            folder.rmdir()


def resolve(command: Train) -> Experiment:
    """Return the experiment of the flags; ConfigError where they contradict one another."""
    tasks.make(command.task)  # an unknown task is refused first, with the valid ones
    if command.resume and command.restart:
        raise ConfigError("--resume and --restart contradict: choose one")
    if command.resume and command.init:
        raise ConfigError("--init starts a new run, --resume continues one: choose one")
    if (command.resume or command.restart) and command.run is None:
        raise ConfigError("--resume and --restart need --run")
    if command.address and command.runner != "ray":
        raise ConfigError("--address joins a Ray cluster: add --runner ray")
    devices.resolve(command.experiment.device)  # refused before a run is made
    if command.experiment.simulator == "warp":
        if command.runner == "ray":
            raise ConfigError("--simulator warp steps all scenes on one device: use --runner local")
        require_warp()
    world = replace(command.experiment.world, task=command.task)
    world = replace(world, episode_s=world.episode_s or tasks.make(command.task).episode_s)
    if command.motions:
        world = replace(world, motions=tuple(str(path.resolve()) for path in command.motions))
    if command.objects:
        world = replace(world, objects=tuple(_furniture(name) for name in command.objects))
    experiment = replace(command.experiment, world=world)
    if experiment.style.mask_holding and not any(
        tasks.make(world.task).affordance.clips.kind == "box" for world in mixing.worlds(experiment)
    ):
        raise ConfigError("--style.mask-holding: only a task with a box to hold can hide the arms")
    mixing.mixture_of(experiment)  # a mixture that cannot be is refused before a run is made
    return check(with_learner_threads(experiment, command.threads or machine.cores()))


def _furniture(name: str) -> str:
    """Return the name of a split unchanged, anything else as an absolute path."""
    return name if name in collection.SPLITS else str(Path(name).resolve())


def workers(command: Train, experiment: Experiment) -> int:
    """Return the number of rollout workers: --actors, else one per thread, at most one per block
    of scenes."""
    wanted = command.actors or command.threads or machine.cores()
    return wanted if command.actors else min(wanted, experiment.scenes // experiment.block)


def prepare(run: RunDirectory, command: Train, experiment: Experiment) -> None:
    """Prepare the run directory, or refuse it with RunError and leave its files untouched."""
    if command.resume:
        if not run.config.exists():
            raise RunError(f"{run.path} holds no run to resume: leave out --resume to start one")
        # settings that are newer than the run have their defaults
        started = recorded(read_experiment(run))
        changed = list(differences(_anywhere(started), _anywhere(recorded(experiment))))
        if changed:
            raise RunError(
                f"{run.path} was started with other settings, which --resume keeps: "
                f"{'; '.join(map(flag, changed))}"
                " (start another run with --init to change them)"
            )
        folder = checkpoint_folder(run.path)
        with contextlib.suppress(CheckpointError):  # resuming falls back to an earlier checkpoint
            require_unedited(read_manifest(folder), experiment, run)
        return
    if run.occupied and not command.restart:
        raise RunError(f"{run.path} exists: add --resume or --restart, or name another --run")
    if command.init and checkpoint_folder(command.init).is_relative_to(run.path.resolve()):
        raise RunError(f"--init {command.init} lies in {run.path}, which --restart erases")
    # unusable furniture and unreadable clips are found before the run exists or an old one is lost
    for world in mixing.worlds(experiment):
        assembly.training_pieces(world)
        assembly.library_of(world)
    if command.restart:
        run.erase()
    run.create()
    run.write_config(
        {
            "task": command.task,
            "seed": experiment.seed,
            "preset": command.preset,
            "experiment": recorded(experiment),
            "machine": machine.describe(),
            "commit": machine.commit(),
            "command": sys.argv[1:],
        }
    )


def require_unedited(manifest: Manifest, experiment: Experiment, run: RunDirectory) -> None:
    """Raise RunError, with the differences, where config.json differs from the settings of a
    checkpoint."""
    noted = manifest.notes.get("experiment")
    if noted is None:
        return  # checkpoints of earlier versions record no experiment
    trained = experiment_from_json(json.loads(noted), f"{run.path}'s checkpoint")
    changed = list(differences(recorded(trained), recorded(experiment)))
    if changed:
        raise RunError(
            f"{run.config} was changed since the checkpoint was written: {'; '.join(changed)}"
            " (restore the former values, or start another run with --init)"
        )


def recorded(experiment: Experiment) -> dict[str, Any]:
    """Return the settings in config.json, which --resume compares: all that numbers depend on."""
    config = to_json(experiment)
    config["ppo"].pop("threads")
    return config


def _anywhere(config: dict[str, Any]) -> dict[str, Any]:
    """Return the settings without the device: a run may resume on another one, though bit for bit
    on the same one alone."""
    return {name: value for name, value in config.items() if name != "device"}


def learn(run: RunDirectory, command: Train, experiment: Experiment) -> int:
    """Train in a prepared run and write a last checkpoint, also when interrupted; return the exit
    code."""
    torch.set_num_threads(1)  # threads and processes run in parallel, each on one core
    goal = Goal(command.iterations, command.samples, (command.minutes or 0) * 60 or None)
    with ExitStack() as stack:
        display = stack.enter_context(open_display(f"{command.task} {run.path}", goal))
        begun = threading.Event()
        stopped = stack.enter_context(interrupts(display.note, begun))
        display.note(f"run {run.path}")
        for world in mixing.worlds(experiment):
            if left_out := assembly.training_pieces(world)[1]:
                display.note(left_out)
        device = devices.resolve(experiment.device)
        display.note(device.reason)
        blocks = experiment.scenes, experiment.block
        stack.enter_context(devices.memory_refusals(device.torch, *blocks))
        if experiment.simulator == "warp":
            display.note("compiling the simulator's kernels: minutes the first time on a machine")
        count = workers(command, experiment)
        runner = stack.enter_context(
            open_runner(command, experiment, run, count, display.note, device.torch)
        )
        learner = assembly.learner(experiment, device.torch)
        display.note(learner.precision.reason)
        note = display.note
        sinks = Recorders(display)
        checkpoints = RunCheckpoints(
            run.checkpoints,
            assembly.layout(experiment),
            assembly.notes(experiment, inherited(run, command)),
            command.keep,
        )
        loop = Loop(
            learner,
            runner.fleet,
            runner.style,
            sinks,
            checkpoints,
            LoopConfig(
                command.iterations,
                command.samples,
                command.checkpoint_every,
                lag=experiment.lag,
            ),
            mixing.term_names(experiment),
            runner.kinds,
            mixing.division(experiment),
        )
        stack.callback(loop.close)
        initialise(loop, run, command, experiment, note)
        sinks.open(open_recorders(run, learner.samples))
        stack.callback(sinks.close)
        begun.set()
        deadline = time.monotonic() + command.minutes * 60 if command.minutes else None
        loop.run(lambda: stopped() or (deadline is not None and time.monotonic() >= deadline))
        display.note(f"checkpoint {learner.version} in {run.checkpoints}")
        return INTERRUPTED if stopped() else 0


def inherited(run: RunDirectory, command: Train) -> tuple[Origin, ...]:
    """Return the origins of the weights that a training begins from: those of --init, or those that
    the run's newest readable checkpoint names."""
    if command.init:
        return lineage.of(read_manifest(checkpoint_folder(command.init)).notes)
    if command.resume:
        for path in sorted(run.checkpoints.glob("[0-9]*"), reverse=True):
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
) -> None:
    """Initialise the loop from a checkpoint, another run's networks, or behaviour cloning."""
    learner = loop.learner
    if command.resume:
        found, damaged = read_newest(run.checkpoints, assembly.layout(experiment))
        for line in damaged:
            note(line)
        require_unedited(found.manifest, experiment, run)
        loop.load_state_dict(found.state)
        dropped = truncate_metrics(run.metrics, learner.version)
        lines = f", {dropped} lines of metrics dropped" if dropped else ""
        note(f"resumed from {found.path}{lines}")
    elif command.init:
        path = checkpoint_folder(command.init)
        found, mine = read(path, ("policy",)), assembly.layout(experiment)
        state, theirs = found.state["policy"], found.manifest.layout
        mixed = mixing.mixture_of(experiment)
        if theirs.goal != mine.goal and is_mixed(theirs.goal):
            # of a mixture, the policy of this task alone, or else of its first one
            older = assembly.experiment_of(found.manifest, path)
            others = mixing.mixture_of(older)
            own = command.task if others is not None and command.task in others.names else ""
            older, state = mixing.of_one_task(older, state, own)
            theirs = assembly.layout(older)
        if mixed is not None and theirs.goal != mine.goal:
            names, level = mixed.equivalents(theirs.task), tasks.make(theirs.task).level
            state = adopt(state, theirs, mine, names, str(path), level)
        elif theirs.task == mine.task:
            mine.require(theirs, str(path))
        else:
            equivalents, level = tasks.make(command.task).equivalents, tasks.make(theirs.task).level
            state = adopt(state, theirs, mine, equivalents, str(path), level)
        learner.load_policy_state(state)
        other = "" if theirs.task == mine.task else f", of the task {theirs.task}"
        note(f"networks and normalisers from {path}{other}")
    elif experiment.clone_passes:
        note(f"behaviour cloning: {experiment.clone_passes} passes over clips")
        began = time.perf_counter()
        errors = clone_clips(learner, experiment)
        note(
            f"behaviour cloning on the clips: error {errors[0]:.3f} -> {errors[-1]:.3f}"
            f" in {time.perf_counter() - began:.1f} s"
        )


def clone_clips(learner: Learner, experiment: Experiment) -> list[float]:
    """Clone the clips into the learner's actor; return the mean squared error of each epoch."""
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
    return clone(
        learner.actor, learner.normaliser, inputs, actions, experiment.clone_passes, seed=seed
    )


class Recorders:
    """Passes every iteration's metrics to the recorders and the display."""

    def __init__(self, display: Display) -> None:
        self._display = display
        self._recorders: list[Recorder] = []

    def open(self, recorders: list[Recorder]) -> None:
        """Set the recorders."""
        self._recorders = recorders

    def record(self, iteration: int, metrics: Mapping[str, float]) -> None:
        """Record and show one iteration's flat metrics."""
        line = {"iteration": iteration, **metrics, "samples": int(metrics["samples"])}
        for recorder in self._recorders:
            recorder.write(line)
        self._display.show(line)

    def close(self) -> None:
        """Close the files."""
        for recorder in self._recorders:
            recorder.close()


@contextmanager
def interrupts(note: Callable[[str], None], begun: threading.Event) -> Iterator[Callable[[], bool]]:
    """Handle Ctrl-C and SIGTERM: the first stops after the iteration, the second at once. Yields
    whether a stop is requested.

    begun: set when the first iteration begins; before it there is nothing to keep, and the first
    signal stops at once.
    """
    requested = False

    def handle(_number: int, _frame: FrameType | None) -> None:
        nonlocal requested
        if requested or not begun.is_set():
            note("stopping at once")
            leave_soon()
            raise KeyboardInterrupt
        requested = True
        note("stopping after this iteration; press again to stop at once, without a checkpoint")

    before = {s: signal.signal(s, handle) for s in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: requested
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)

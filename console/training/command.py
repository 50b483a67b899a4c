"""`inhabit train`: creates or resumes a run and trains until a limit or a stop signal."""

import contextlib
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

from console import bounds
from console.commands import Train
from console.run import ancestors, assembly, machine, mixing, recipe
from console.run.arrivals import walker_of
from console.run.directory import RunDirectory, RunError, checkpoint_folder, new_run, policy_source
from console.run.experiment import (
    Experiment,
    check,
    differences,
    read_experiment,
    with_learner_threads,
)
from console.run.metrics import Recorder, open_recorders
from console.run.policy_teachers import policy_teachers
from console.run.renamed import flag, taught_by
from console.run.rollouts import tracker_of
from console.terminal import doing, leave_soon, note
from console.training import beginning, dry_run, earlier
from console.training.beginning import recorded, require_unedited
from console.training.display import Display, open_display
from console.training.goal import Goal
from console.training.runners import require_shape
from console.training.staging import Training, workers
from learner.loop import Loop
from policy.checkpoints.format import read_manifest
from policy.checkpoints.numbering import numbered
from policy.errors import CheckpointError
from world import device as devices
from world import tasks
from world.config import WorldConfig
from world.errors import ConfigError
from world.initial import reference
from world.meshes import collection
from world.scene.simulators import require_warp

INTERRUPTED = 130


def train(command: Train, inhabit: earlier.Inhabit = earlier.refused) -> int:
    """Run `inhabit train`; return the exit code.

    inhabit: runs another command, as a recipe may name some that come before.
    """
    experiment = resolve(command)
    if command.experiment.before and not experiment.before:
        note(f"--init {command.init}: what the recipe trains before this run is left out")
    if command.dry_run:
        # the package's own are sound, and a dry run of them need not wait for reading
        if experiment.world.motions or experiment.world.objects:
            with doing("reading furniture and clips"):
                require_data(experiment)
        for line in command.overrides:
            print(line)
        print(dry_run.describe(experiment))
        return 0
    run = RunDirectory(command.run) if command.run else new_run(command.task)
    made = [folder for folder in (run.path, *run.path.parents) if not folder.exists()]
    with run.lock():  # held to the last: who is refused the lock leaves all as it is
        occupied = run.occupied
        try:
            with doing("reading furniture and clips"):
                prepare(run, command, experiment)
            if earlier.wanted(run, experiment):
                code, command = earlier.train(run, command, experiment, inhabit, note)
                if code is not None:
                    return code
            return learn(run, command, experiment)
        finally:
            if not occupied and not earlier.begun(run):
                remove_unbegun(run, made)


def remove_unbegun(run: RunDirectory, made: Sequence[Path]) -> None:
    """Remove a run in which nothing was trained: no iteration recorded and no checkpoint.

    made: its folders that were not there before, the innermost first; others stay.
    """
    recorded_any = run.metrics.exists() and run.metrics.stat().st_size > 0
    if recorded_any or numbered(run.checkpoints):
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
    begins_from = command.init or command.experiment.before
    if command.preset == "finetune" and not (begins_from or command.resume):
        flag, other = "--preset finetune", "the preset fast"
        if command.recipe:
            flag, other = f"--recipe {command.recipe}", "another recipe"
        raise ConfigError(
            f"{flag} goes on from a policy that can already do the task, or a part of it: add"
            f" --init, or choose {other}"
        )
    if command.style_service.address and len(command.experiment.stages) > 1:
        # each stage draws its mocap by a seed of its own
        raise ConfigError(
            "--style-service.address: the discriminator of this recipe has other settings in each"
            " stage, while those of a standalone service stay: leave it out"
        )
    if command.address and command.runner != "ray":
        raise ConfigError("--address joins a Ray cluster: add --runner ray")
    devices.resolve(command.experiment.device)  # refused before a run is made
    if command.experiment.simulator == "warp":
        if command.runner == "ray":
            raise ConfigError("--simulator warp steps all scenes on one device: use --runner local")
        require_warp()
    world = replace(command.experiment.world, task=command.task)
    world = replace(world, episode_s=world.episode_s or tasks.make(command.task).episode_s)
    if not command.resume and not world.classes and not command.experiment.mix:
        world = replace(world, classes=tasks.make(command.task).affordance.classes)
    if command.motions:
        world = replace(world, motions=tuple(str(path.resolve()) for path in command.motions))
    if command.objects:
        world = replace(world, objects=tuple(_furniture(name) for name in command.objects))
    begun = _begun(command)
    for name in ("teacher", "walker", "rollouts"):
        if source := getattr(world.track, name):
            source = _same_policy(source, getattr(begun.track, name))
            world = replace(world, track=replace(world.track, **{name: source}))
    for name in ("walker", "tracker", "expert"):
        if source := getattr(world, name):
            world = replace(world, **{name: _same_policy(source, getattr(begun, name))})
    experiment = replace(command.experiment, world=world)
    if command.init:  # from there instead of what the recipe would make first
        experiment = replace(experiment, before=())
    if experiment.style.mask_holding and not any(
        tasks.make(world.task).affordance.clips.holds for world in mixing.worlds(experiment)
    ):
        raise ConfigError("--style.mask-holding: only a task with a box to hold can hide the arms")
    mixed = mixing.mixture_of(experiment)  # one that cannot be is refused before a run is made
    begins = not (command.init or command.resume)
    if mixed is not None and begins and experiment.clone_passes and len(mixed.shown[0]) > 1:
        raise ConfigError(
            f"--clone-passes {experiment.clone_passes}: with --world.track.goal the policy does not"
            " see the clips that it would follow: add --clone-passes 0"
        )
    experiment = with_learner_threads(experiment, command.threads or machine.cores())
    for number, stage in enumerate(experiment.stages, 1):  # refused at once, not hours later
        if experiment.mix and recipe.TASK in stage.settings:
            raise ConfigError(
                f"--mix: stage {stage.name} of the recipe has the task"
                f" {stage.settings[recipe.TASK]} alone: choose another recipe, or leave out --mix"
            )
        recipe.stage_end(experiment, number, mixing.kind_names(experiment))
        staged = recipe.staged(experiment, number)
        try:
            bounds.require(staged)
            check(staged)
            require_shape(command, staged, workers(command, staged))
            policy_teachers(staged, assembly.trained)
        except ConfigError as error:
            raise ConfigError(f"--recipe: stage {stage.name}: {error}") from None
    check(experiment)
    require_shape(command, experiment, workers(command, experiment))
    policy_teachers(experiment, assembly.trained)
    walker_of(experiment, assembly.trained)
    tracker_of(experiment, assembly.trained)
    return experiment


def _begun(command: Train) -> WorldConfig:
    """Return the world of the run that is resumed; an empty one for a new run."""
    run = RunDirectory(command.run) if command.resume and command.run else None
    return read_experiment(run).world if run is not None and run.config.exists() else WorldConfig()


def _same_policy(named: str, begun: str) -> str:
    """Return the policy that a flag names; of the run that it names, the checkpoint with which a
    resumed training began, if it is one of that run's."""
    if begun and Path(begun).is_relative_to(Path(named).resolve()):
        return begun
    return policy_source(named)


def _furniture(name: str) -> str:
    """Return the name of a split unchanged, anything else as an absolute path."""
    return name if name in collection.SPLITS else str(Path(name).resolve())


def require_data(experiment: Experiment) -> None:
    """Raise an InhabitError where clips or furniture that the flags name cannot be used."""
    stages = range(1, len(experiment.stages) + 1) or (1,)
    staged = [mixing.worlds(recipe.staged(experiment, number)) for number in stages]
    for worlds in zip(*staged, strict=True):  # those of one task, whose clips are read once
        for world in worlds:
            assembly.training_pieces(world)
            library = assembly.library_of(world)
            if not tasks.make(world.task).affordance.follows_clips:
                reference.require(world.initial, library)


def prepare(run: RunDirectory, command: Train, experiment: Experiment) -> None:
    """Prepare the run directory, or refuse it with RunError and leave its files untouched."""
    if command.resume:
        if not run.config.exists():
            raise RunError(f"{run.path} holds no run to resume: leave out --resume to start one")
        config = run.read_config()
        own = config.get("recipe", "")
        if command.recipe not in ("", own):
            said = f"with --recipe {own}" if own else "without a recipe"
            raise RunError(f"{run.path} was started {said}: --resume goes on with that")
        # settings that are newer than the run have their defaults
        started = recorded(read_experiment(run))
        if (gone := taught_by(config["experiment"])) is not None:
            raise RunError(
                f"{run.path} was taught by {flag(gone)}, which no longer exists: start another run"
                " with --init"
            )
        changed = list(differences(_anywhere(started), _anywhere(recorded(experiment))))
        if changed:
            raise RunError(
                f"{run.path} was started with other settings, which --resume keeps: "
                f"{'; '.join(map(flag, changed))}"
                " (start another run with --init to change them)"
            )
        if earlier.wanted(run, experiment):
            return
        folder = checkpoint_folder(run.path)
        with contextlib.suppress(CheckpointError):  # resuming falls back to an earlier checkpoint
            require_unedited(read_manifest(folder), experiment, run)
        return
    if run.occupied and not command.restart:
        raise RunError(f"{run.path} exists: add --resume or --restart, or name another --run")
    if command.init and checkpoint_folder(command.init).is_relative_to(run.path.resolve()):
        raise RunError(f"--init {command.init} lies in {run.path}, which --restart erases")
    require_data(experiment)  # before the run exists or an old one is lost
    if command.init:
        ancestors.networks(command.init, experiment)
    if command.restart:
        run.erase()
    run.create()
    run.write_config(
        {
            "task": command.task,
            "seed": experiment.seed,
            "preset": command.preset,
            "recipe": command.recipe,
            "overrides": list(command.overrides),
            "experiment": recorded(experiment),
            "machine": machine.describe(),
            "commit": machine.commit(),
            "command": sys.argv[1:],
        }
    )


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
        title = f"{command.task} {run.path}"
        display = stack.enter_context(open_display(title, goal, stages=experiment.stages))
        begun = threading.Event()
        loops: list[Loop] = []

        def abandon() -> None:
            if loops:
                loops[-1].abandon()

        stopped = stack.enter_context(interrupts(display.note, begun, abandon))
        display.note(f"run {run.path}")
        for line in command.overrides:
            display.note(line)
        for world in mixing.worlds(experiment):
            if left_out := assembly.training_pieces(world)[1]:
                display.note(left_out)
        device = devices.resolve(experiment.device)
        display.note(device.reason)
        blocks = experiment.scenes, experiment.block
        stack.enter_context(devices.memory_refusals(device.torch, *blocks))
        if experiment.simulator == "warp":
            display.note("compiling the simulator's kernels: minutes the first time on a machine")
        sinks = Recorders(display)
        stack.callback(sinks.close)
        deadline = time.monotonic() + command.minutes * 60 if command.minutes else None

        def stop() -> bool:
            return stopped() or (deadline is not None and time.monotonic() >= deadline)

        def leave() -> None:
            if stopped():
                leave_soon()  # whatever workers and threads are at

        def begin(samples: int) -> None:
            sinks.open(open_recorders(run, samples))
            begun.set()

        origins = beginning.inherited(run, command, experiment)
        training = Training(run, command, experiment, device.torch, display.note, sinks, origins)
        resumed = beginning.newest(run, experiment, display.note) if command.resume else None
        with doing(display.stage):
            training.train(resumed, stop, begin, loops.append, leave)
        return INTERRUPTED if stopped() else 0


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
def interrupts(
    note: Callable[[str], None], begun: threading.Event, abandon: Callable[[], None]
) -> Iterator[Callable[[], bool]]:
    """Handle Ctrl-C and SIGTERM: the first drops the unfinished iteration, the second stops at
    once. Yields whether a stop is requested.

    begun: set when the first iteration begins; before it there is nothing to keep, and the first
    signal stops at once.
    abandon: ends the iteration soon.
    """
    requested = False

    def handle(_number: int, _frame: FrameType | None) -> None:
        nonlocal requested
        if requested or not begun.is_set():
            note("stopping at once")
            leave_soon()
            raise KeyboardInterrupt
        requested = True
        note(
            "stopping: the checkpoint will be that of the last complete iteration; press again to"
            " stop at once, without a checkpoint"
        )
        abandon()

    before = {s: signal.signal(s, handle) for s in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: requested
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)

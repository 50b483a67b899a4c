"""The runs of a recipe that are made before its own: each a command of its own, in RUN/before."""

import json
import shlex
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from console.commands import Train
from console.run.directory import RunDirectory, RunError, write_json
from console.run.experiment import Experiment
from console.run.metrics import truncate_metrics
from console.run.stages import Before
from console.terminal import INTERRUPTED
from policy.checkpoints.numbering import numbered

Inhabit = Callable[[Sequence[str]], int]
"""Runs the command of these words, without `inhabit`; returns the exit code."""
#: Names of the runs that are complete, in RUN/before.
_COMPLETE = "complete.json"


def refused(words: Sequence[str]) -> int:
    """Refuse to run another command, where a training is a part of one that needs no recipe."""
    raise RunError(f"inhabit {shlex.join(words)}: a recipe with runs before it needs inhabit train")


def wanted(run: RunDirectory, experiment: Experiment) -> bool:
    """Return whether the run cannot begin before others are made."""
    return bool(experiment.before) and not numbered(run.checkpoints)


def begun(run: RunDirectory) -> bool:
    """Return whether something was learned before the run, that it would be a loss to remove."""
    return run.before.exists() and any(run.before.iterdir())


def train(
    run: RunDirectory,
    command: Train,
    experiment: Experiment,
    inhabit: Inhabit,
    note: Callable[[str], None],
) -> tuple[int | None, Train]:
    """Make what is not complete of the runs before this one; return the exit code where training
    ends there, and the command with which this run begins.

    --minutes count from the first of them. Raises RunError where one fails.
    """
    began = time.monotonic()
    for one in experiment.before:
        if one.name in _complete(run):
            continue
        left = _left(command, began)
        given = words(one, run, command, experiment, left and max(left, 0.001))
        note(f"before {run.path}: inhabit {shlex.join(given)}")
        code = inhabit(given)
        if code == INTERRUPTED:
            note(f"--resume --run {run.path} goes on with {one.name}")
            return code, command
        if code:
            raise RunError(
                f"{run.before / one.name} ended with exit code {code}; --resume --run {run.path}"
                " tries it again"
            )
        left = _left(command, began)
        over = left is not None and left <= 0.0
        if not (over and given[0] == "train"):  # which the time may have stopped
            write_json(run.before / _COMPLETE, [*_complete(run), one.name])
        if over:
            return 0, command
    truncate_metrics(run.metrics, 0)  # of an earlier begin, which left no checkpoint
    init = run.before / experiment.before[-1].name
    return None, replace(command, resume=False, init=init, minutes=_left(command, began))


def words(
    one: Before, run: RunDirectory, command: Train, experiment: Experiment, minutes: float | None
) -> list[str]:
    """Return the words of the command that makes one of the runs, or goes on with it.

    What is not said in the recipe is that of the command: clips, seed, widths, runner, device.
    minutes: wall time that is left for it; None: any.
    """
    folder = run.before / one.name
    verb, task, *flags = shlex.split(_named(one.command, experiment, run.before))
    if verb == "train":
        head = ["train", task, "--run", str(folder)]
        # before its first checkpoint there is nothing to resume
        made = RunDirectory(folder)
        head += ["--resume" if numbered(made.checkpoints) else "--restart"] * made.occupied
        own = _of_training(command, experiment, minutes)
    else:
        head = ["distill", task, str(folder), *["--replace"] * folder.exists()]
        own = {"--hidden": [str(width) for width in experiment.ppo.hidden]}
    own |= {"--seed": [str(experiment.seed)]} | ({"--debug": []} if command.debug else {})
    if one.clips == "given" and experiment.world.motions:
        own["--motions"] = list(experiment.world.motions)
    said = {word.partition("=")[0] for word in flags}
    more = [word for flag, values in own.items() if flag not in said for word in (flag, *values)]
    return [*head, *flags, *more]


def _of_training(
    command: Train, experiment: Experiment, minutes: float | None
) -> dict[str, list[str]]:
    given = {
        "--runner": command.runner,
        "--threads": command.threads,
        "--actors": command.actors,
        "--address": command.address,
        "--checkpoint-every": command.checkpoint_every,
        "--keep": command.keep,
        "--minutes": minutes,
        "--device": experiment.device,
    }
    found = {flag: [str(value)] for flag, value in given.items() if value is not None}
    return found | {"--ppo.hidden": [str(width) for width in experiment.ppo.hidden]}


def _named(text: str, experiment: Experiment, folder: Path) -> str:
    """The command with the folders of other runs for {NAME}."""
    for other in experiment.before:
        text = text.replace(f"{{{other.name}}}", shlex.quote(str(folder / other.name)))
    return text


def _complete(run: RunDirectory) -> list[str]:
    file = run.before / _COMPLETE
    return json.loads(file.read_text()) if file.exists() else []


def _left(command: Train, began: float) -> float | None:
    """The minutes that are left of --minutes; None: any number."""
    if command.minutes is None:
        return None
    return command.minutes - (time.monotonic() - began) / 60.0

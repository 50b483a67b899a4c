"""Trainings on real scenes with either runner, and the comparison of what they hold."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import torch

from console.commands import Train
from console.run import assembly
from console.run.directory import RunDirectory
from console.run.experiment import Experiment, with_learner_threads
from console.training.runners import open_runner
from learner.config import LoopConfig
from learner.loop import Loop
from policy.checkpoints.format import flatten
from policy.checkpoints.run_checkpoints import RunCheckpoints
from world import tasks


class Kept:
    """A recorder that keeps every line."""

    def __init__(self) -> None:
        self.lines: list[dict[str, float]] = []

    def record(self, iteration: int, metrics: Mapping[str, float]) -> None:
        self.lines.append({"iteration": iteration, **metrics})


@contextmanager
def opened(
    experiment: Experiment, folder: Path, iterations: int, runner: str = "local", workers: int = 1
) -> Iterator[Loop]:
    """The loop as `inhabit train` wires it, in a run directory of its own."""
    command = Train(
        task="sit",
        experiment=experiment,
        runner="ray" if runner == "ray" else "local",
        actors=workers,
        iterations=iterations,
    )
    experiment = with_learner_threads(experiment, workers)
    run = RunDirectory(folder)
    run.create()
    faults: list[str] = []
    with open_runner(command, experiment, run, workers, faults.append) as behind:
        loop = Loop(
            assembly.learner(experiment),
            behind.fleet,
            behind.style,
            Kept(),
            RunCheckpoints(run.checkpoints, assembly.layout(experiment), keep=9),
            LoopConfig(iterations=iterations, checkpoint_iterations=2),
            tuple(tasks.make("sit").terms),
            behind.kinds,
        )
        yield loop
        loop.close()
    assert not faults, "nothing went wrong and was mended behind the comparison"


def everything(state: Mapping[str, Any]) -> dict[str, Any]:
    """All that a checkpoint holds, by path, but the wall time."""
    tensors, values = flatten(state)
    del values["training/seconds"]
    return tensors | values


def assert_same(got: Mapping[str, Any], wanted: Mapping[str, Any]) -> None:
    assert got.keys() == wanted.keys()
    differing = [
        name
        for name, value in wanted.items()
        if not (
            torch.equal(got[name], value) if isinstance(value, torch.Tensor) else got[name] == value
        )
    ]
    assert not differing


def lines(loop: Loop) -> list[dict[str, float]]:
    """The metrics of all iterations, but those of time and of how many workers there were."""
    assert isinstance(loop.recorder, Kept)
    return [
        {k: v for k, v in line.items() if not k.startswith(("rate/", "seconds", "actors/"))}
        for line in loop.recorder.lines
    ]

"""`inhabit train`'s own loop in a process of `inhabit bench peers` or `learning`, with the local
runner."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import torch

from console.bench.peers import protocol
from console.bench.peers.counters import counted
from console.bench.peers.protocol import Assignment, Iterate
from console.run import assembly, mixing
from console.run.directory import RunDirectory
from console.training.runners import local_runner
from learner.config import LoopConfig
from learner.loop import Loop
from learner.ppo import Learner
from learner.protocols import Fleet, State, Style


class Nowhere:
    """A recorder and checkpoint store that discards everything."""

    def record(self, iteration: int, metrics: object) -> None:
        """Discard metrics."""

    def save(self, iteration: int, state: State, best: bool = False) -> None:
        """Discard a checkpoint."""


@contextmanager
def open_peer(assignment: Assignment) -> Iterator[Iterate]:
    """Open a training; its style reward is on where its weight is above 0."""
    experiment = assignment.experiment
    torch.set_num_threads(1)  # the learner has threads of its own
    student = assembly.learner(experiment)
    with tempfile.TemporaryDirectory() as folder:
        run = RunDirectory(Path(folder))
        wrap = partial(counted, folder=assignment.counters)
        with (
            local_runner(experiment, run, assignment.threads, wrap=wrap) as runner,
            iterating(assignment, student, runner.fleet, runner.style) as iterate,
        ):
            yield iterate


@contextmanager
def iterating(
    assignment: Assignment, student: Learner, fleet: Fleet, style: Style | None
) -> Iterator[Iterate]:
    """Open the training loop of `inhabit train` over a fleet."""
    terms = mixing.term_names(assignment.experiment)
    nowhere = Nowhere()
    loop = Loop(student, fleet, style, nowhere, nowhere, LoopConfig(), terms)

    def iterate() -> int:
        loop.iterate()
        return assignment.batch

    try:
        yield iterate
    finally:
        loop.close()


if __name__ == "__main__":
    protocol.serve(open_peer)

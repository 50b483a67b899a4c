"""The protocol between `inhabit bench peers` or `learning` and the process of a peer: JSON lines.

Standard input: an Assignment, then {"seconds": S} for each turn, or {"samples": N} for each window
of a curve. Standard output: {"ready": true}, for turns once two iterations have run, then a Turn
for each turn and a Window for each window. The process ends with its standard input.
"""

import json
import os
import random
import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
import torch

from console.bench.peers import counters
from console.bench.peers.curves import Window
from console.run import machine
from console.run.experiment import Experiment, experiment_from_json, to_json
from world import precision

WARM_ITERATIONS = 2


@dataclass(frozen=True)
class Assignment:
    """What a peer trains, and on how many cores."""

    experiment: Experiment
    threads: int
    """Cores of the measurement: worker processes of the scenes, and threads of the update."""
    counters: str = ""
    """Folder in which the scenes count rewards and ends of episodes, for windows of a curve; empty:
    nothing is counted."""

    @property
    def bf16(self) -> bool:
        """Whether this processor multiplies bf16 natively."""
        return precision.decide("cpu").autocast is not None

    @property
    def sigma(self) -> float:
        """Standard deviation of the action noise at the start."""
        return self.experiment.ppo.sigma[0][1]

    @property
    def batch(self) -> int:
        """Samples of an iteration."""
        return self.experiment.scenes * self.experiment.horizon

    @property
    def minibatches(self) -> int:
        """Minibatches of an epoch, as in learner.ppo."""
        return max(1, round(self.batch / self.experiment.ppo.minibatch))

    def to_json(self) -> dict[str, Any]:
        """Return the assignment as JSON values."""
        own = {"threads": self.threads, "counters": self.counters}
        return {"experiment": to_json(self.experiment), **own}

    @staticmethod
    def from_json(value: dict[str, Any]) -> "Assignment":
        """Return the assignment of JSON values."""
        experiment = experiment_from_json(value["experiment"])
        return Assignment(experiment, int(value["threads"]), str(value["counters"]))


@dataclass(frozen=True)
class Turn:
    """What a peer did in one turn."""

    samples: int
    """Control steps that it trained on."""
    seconds: float
    processor_s: float
    """Processor time of its processes, s: on a shared machine the steadier measure."""
    iterations: int
    resident_gb: float
    """Resident memory of its processes at the end of the turn, GB; shared pages count in each."""
    peak_gb: float
    """Sum of its processes' own peaks (VmHWM) since they began, GB."""

    @property
    def rate(self) -> float:
        """Samples per second."""
        return self.samples / self.seconds

    @property
    def processor_rate(self) -> float:
        """Samples per second of processor time."""
        return self.samples / max(self.processor_s, 1e-9)


#: Runs one whole training iteration and returns its number of samples.
Iterate = Callable[[], int]
Open = Callable[[Assignment], AbstractContextManager[Iterate]]


def serve(open_peer: Open) -> None:
    """Answer the lines of standard input until it ends; the adapters' main function.

    What a library prints goes to standard error.
    """
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", buffering=1)
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    answer(open_peer, sys.stdin, answers)


def answer(open_peer: Open, questions: IO[str], answers: IO[str]) -> None:
    """Read an assignment, run its turns or windows and write their results."""
    assignment = Assignment.from_json(json.loads(questions.readline()))
    torch.set_num_threads(assignment.threads)
    seed_all(assignment.experiment.seed)
    with open_peer(assignment) as iterate:
        # a curve begins with the first sample
        for _ in range(0 if assignment.counters else WARM_ITERATIONS):
            iterate()
        training = Training(iterate, Path(assignment.counters))
        _write(answers, {"ready": True})
        for line in questions:
            asked = json.loads(line)
            if "samples" in asked:
                _write(answers, asdict(training.until(int(asked["samples"]))))
            else:
                _write(answers, asdict(turn(iterate, float(asked["seconds"]))))


def seed_all(seed: int) -> None:
    """Seed the generators that libraries draw networks, noise and minibatches from; the scenes have
    their own streams of the experiment's seed."""
    random.seed(seed)
    np.random.seed(seed % 2**32)  # noqa: NPY002
    torch.manual_seed(seed)


def turn(iterate: Iterate, seconds: float) -> Turn:
    """Run whole iterations for at least this time, and at least one."""
    samples, iterations, spent = 0, 0, 0.0
    processor = machine.process_tree_seconds()
    began = time.perf_counter()
    while iterations == 0 or spent < seconds:
        samples += iterate()
        iterations += 1
        spent = time.perf_counter() - began
    return Turn(
        samples,
        spent,
        machine.process_tree_seconds() - processor,
        iterations,
        machine.process_tree_gb(),
        machine.process_tree_peak_gb(),
    )


class Training:
    """A training whose scenes are counted, window by window."""

    def __init__(self, iterate: Iterate, folder: Path) -> None:
        self._iterate, self._folder = iterate, folder
        self._samples = 0
        self._before = counters.Counts()

    def until(self, samples: int) -> Window:
        """Run whole iterations until this many samples have been trained on since the beginning."""
        began = time.perf_counter()
        while self._samples < samples:
            self._samples += self._iterate()
        seconds = time.perf_counter() - began
        now = counters.read(self._folder)
        found, self._before = now - self._before, now
        return Window(
            samples=self._samples,
            control_steps=round(found.control_steps),
            reward=found.reward,
            episodes=round(found.episodes),
            returns=found.returns,
            falls=round(found.falls),
            seconds=seconds,
        )


def _write(answers: IO[str], value: dict[str, Any]) -> None:
    answers.write(json.dumps(value) + "\n")
    answers.flush()

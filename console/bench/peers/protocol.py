"""The protocol between `inhabit bench peers` and the process of a peer: lines of JSON.

Standard input: an Assignment, then {"seconds": S} for each turn. Standard output: {"ready": true}
once two iterations have run, then a Turn for each turn. The process ends with its standard input.
"""

import json
import os
import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from typing import IO, Any

import torch

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
        return {"experiment": to_json(self.experiment), "threads": self.threads}

    @staticmethod
    def from_json(value: dict[str, Any]) -> "Assignment":
        """Return the assignment of JSON values."""
        return Assignment(experiment_from_json(value["experiment"]), int(value["threads"]))


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
    """Read an assignment, run its turns and write their results."""
    assignment = Assignment.from_json(json.loads(questions.readline()))
    torch.set_num_threads(assignment.threads)
    with open_peer(assignment) as iterate:
        for _ in range(WARM_ITERATIONS):
            iterate()
        _write(answers, {"ready": True})
        for line in questions:
            _write(answers, asdict(turn(iterate, float(json.loads(line)["seconds"]))))


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


def _write(answers: IO[str], value: dict[str, Any]) -> None:
    answers.write(json.dumps(value) + "\n")
    answers.flush()

"""Estimate of the training speed of this machine, from some seconds of training."""

import tempfile
import time
from dataclasses import replace
from pathlib import Path

from console.commands import Train
from console.doctor.finding import Finding
from console.run import assembly, mixing
from console.run.directory import RunDirectory
from console.run.experiment import PRESETS, Experiment, with_learner_threads
from console.run.machine import cores
from console.training.runners import open_runner
from learner.config import LoopConfig
from learner.loop import Loop

PIECES = 8  # compiling all pieces of furniture takes longer than the measurement


def estimate(seconds: float) -> Finding:
    """Measure samples/s of whole iterations on all cores, after two of warm-up."""
    threads = cores()
    fast = PRESETS["fast"]
    experiment = with_learner_threads(
        replace(
            fast,
            world=replace(fast.world, pieces=PIECES),
            ppo=replace(fast.ppo, warmup_iterations=0),
        ),
        threads,
    )
    rate, iterations = measure(
        experiment, min(threads, experiment.scenes // experiment.block), seconds
    )
    hours = 40e6 / rate / 3600
    return Finding(
        "rate", "ok",
        f"{rate:,.0f} samples/s ({experiment.scenes} scenes, {iterations} iterations):"
        f" 40 million samples in {hours:.1f} h",
    )  # fmt: skip


def measure(experiment: Experiment, workers: int, seconds: float) -> tuple[float, int]:
    """Return samples/s of the local runner over at least `seconds` and one iteration, and the
    number of iterations."""
    command = Train(task=experiment.world.task, experiment=experiment, threads=workers)
    terms = mixing.term_names(experiment)
    with tempfile.TemporaryDirectory() as folder:
        run = RunDirectory(Path(folder))
        with open_runner(command, experiment, run, workers, print) as runner:
            learner = assembly.learner(experiment)
            loop = Loop(learner, runner.fleet, runner.style, Null(), Null(), LoopConfig(), terms)
            try:
                runner.ready()
                for _ in range(2):
                    loop.iterate()
                began, count = time.perf_counter(), 0
                while not count or time.perf_counter() - began < seconds:
                    loop.iterate()
                    count += 1
                spent = time.perf_counter() - began
            finally:
                loop.close()
    return experiment.scenes * experiment.horizon * count / spent, count


class Null:
    """A recorder and checkpoint store that discards everything."""

    def record(self, iteration: int, metrics: object) -> None:
        """Discard metrics."""

    def save(self, iteration: int, state: object, best: bool = False) -> None:
        """Discard a checkpoint."""

"""How far actors scale: what the learner takes in from many of them, and what overlapping gains.

The actors are stand-ins that sleep as long as a real one was measured to compute, so that two cores
can have hundreds; all traffic is real: weights through the object store, rollouts of full size. The
learner's own limit is measured apart, on parts that are there while nobody else computes.
"""

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from statistics import median, quantiles
from typing import Any

import ray
from torch import Tensor

from actors.cluster import ray_session
from actors.worker import Worker
from console.bench.stand_in_fleet import SleepingFleet, sleepers
from console.run import assembly
from console.run.experiment import Experiment
from learner.config import LagConfig, LoopConfig
from learner.loop import Loop
from policy.rollout import Rollout

ACTORS = (1, 2, 4, 16, 64, 200)
PROCESSES = 4
"""That share the actors: each takes some 100 MB and seconds to start."""
OVERLAPPING = 4
"""Actors of the comparison of lockstep and overlapped."""
SHARES = (0.5, 1.0, 2.0)
"""Time of the actors in it, in units of the learner's."""
ROUNDS = 3
"""Everything is measured so often, in turn: other work on the machine comes and goes."""
OBJECT_STORE_BYTES = 2**31


@dataclass
class Spent:
    """Seconds of each collection: by the clock, and of processor time.

    Of the learner's process, which has Ray's threads, and of the learner's thread alone.
    """

    wall: list[float] = field(default_factory=list)
    processor: list[float] = field(default_factory=list)
    thread: list[float] = field(default_factory=list)

    @contextmanager
    def one(self) -> Iterator[None]:
        """What happens inside is a collection."""
        began = _clocks()
        yield
        self.add(began, 1)

    def add(self, began: tuple[float, float, float], count: int) -> None:
        """So many collections since `began`, as one of their mean."""
        kinds = self.wall, self.processor, self.thread
        for kind, a, b in zip(kinds, began, _clocks(), strict=True):
            kind.append((b - a) / count)


def _clocks() -> tuple[float, float, float]:
    return time.perf_counter(), time.process_time(), time.thread_time()


def measure(experiment: Experiment, scenes: int, seconds: float) -> dict[str, float]:
    """Ingest by the number of actors against the ideal and its own limit, lockstep and overlapped.

    scenes: of an actor. seconds: how long each figure is measured.
    """
    experiment = replace(experiment, ppo=replace(experiment.ppo, warmup_iterations=0))
    part, took_s = real_part(experiment, scenes, seconds)
    student = assembly.learner(experiment)
    weights = student.weights()
    student.close()
    with (
        ray_session(cpus=PROCESSES, object_store_bytes=OBJECT_STORE_BYTES),
        sleepers(part, PROCESSES) as hosts,
    ):
        lockstep = {actors: Spent() for actors in ACTORS}
        ahead = {actors: Spent() for actors in ACTORS}
        ready, received = Spent(), Spent()
        for _ in range(ROUNDS):
            for actors in ACTORS:
                fleet = SleepingFleet(hosts, part, actors, took_s)
                collect(fleet, weights, seconds / ROUNDS, lockstep[actors])
                collect_ahead(fleet, weights, seconds / ROUNDS, ahead[actors])
            fleet = SleepingFleet(hosts, part, max(ACTORS), 1.0)
            take_ready(fleet, weights, seconds / ROUNDS, ready, received)
        figures = {
            "actor_samples": float(part.samples),
            "actor_rollout_s": took_s,
            "actor_samples_per_s": part.samples / took_s,
            "bytes_per_sample": size(part) / part.samples,
            "actor_processes": float(PROCESSES),
        }
        figures |= limits(ready, received, max(ACTORS) * part.samples, size(part) / part.samples)
        limit = figures["limit_samples_per_s"]
        figures |= ingested(lockstep, part, took_s, limit, "lockstep_")
        figures |= ingested(ahead, part, took_s, limit)
        update_s = updating(experiment, part)
        for share in SHARES:
            fleet = SleepingFleet(hosts, part, OVERLAPPING, share * update_s)
            found = overlapping(experiment, fleet, seconds)
            figures |= {f"actors_at_{share:g}_{name}": value for name, value in found.items()}
    return figures


def real_part(experiment: Experiment, scenes: int, seconds: float) -> tuple[Rollout, float]:
    """A real actor's rollout of so many scenes, and the processor time that it takes.

    Processor time, since other work on this machine is none of the actor's.
    """
    owned = range(scenes)
    shard = assembly.shard(experiment.world, owned, experiment.seed)
    worker = Worker(shard, owned, experiment.seed, experiment.block)
    student = assembly.learner(experiment)
    weights = student.weights()
    student.close()
    spent: list[float] = []
    began = time.perf_counter()
    while True:
        before = time.process_time()
        rollout = worker.rollout(weights, 0, experiment.horizon, experiment.ppo.sigma[0][1])
        spent.append(time.process_time() - before)
        if len(spent) >= 5 and time.perf_counter() - began >= seconds:
            return rollout, median(spent)


def size(rollout: Rollout) -> int:
    """Bytes of its tensors."""
    return sum(t.numel() * t.element_size() for t in rollout.tensors().values())


def collect(
    fleet: SleepingFleet, weights: Mapping[str, Tensor], seconds: float, spent: Spent
) -> None:
    """Collect in lockstep for so many seconds and at least four times, with nothing else to do."""
    fleet.collect(weights, 0, 0.0)
    began, count = time.perf_counter(), 0
    while count < 4 or time.perf_counter() - began < seconds:
        with spent.one():
            fleet.collect(weights, count, 0.0)
        count += 1


def collect_ahead(
    fleet: SleepingFleet, weights: Mapping[str, Tensor], seconds: float, spent: Spent
) -> None:
    """As overlapped: actors know what comes next before they are done; `Gathering` has the order.

    One figure, the mean: a collection that ends late makes the next one short.
    """
    under_way = fleet.ask(weights, 0)
    began, count = _clocks(), 0
    while count < 6 or time.perf_counter() - began[0] < seconds:
        count += 1
        coming = fleet.ask(weights, count)
        fleet.take_in(under_way)
        under_way = coming
        if count == 2:
            began = _clocks()
    spent.add(began, count - 2)
    fleet.take_in(under_way)


def take_ready(
    fleet: SleepingFleet,
    weights: Mapping[str, Tensor],
    seconds: float,
    ready: Spent,
    received: Spent,
) -> None:
    """Take in parts that are there, and ask for the next ones, while all actors sleep.

    received: what Ray's threads did in this process until the parts were there.
    """
    waiting = fleet.ask(weights, 0)
    began, count = time.perf_counter(), 0
    while count < 2 or time.perf_counter() - began < seconds:
        with received.one():
            ray.wait(waiting, num_returns=len(waiting))
        with ready.one():
            coming = fleet.ask(weights, count + 1)
            fleet.take_in(waiting)
        waiting, count = coming, count + 1
    fleet.take_in(waiting)


def limits(ready: Spent, received: Spent, samples: int, width: float) -> dict[str, float]:
    """What a learner with one core could take in, and one whose Ray has another.

    samples: of a collection. width: bytes of a sample. By processor time, the least disturbed tenth
    of the collections: other work on the machine slows the processor's caches down, too.
    """
    core = _least(ready.processor) + _least(received.processor)
    thread = _least(ready.thread)
    return {
        "limit_samples_per_s": samples / core,
        "limit_bytes_per_s": samples / core * width,
        "limit_of_the_thread_samples_per_s": samples / thread,
        "limit_of_the_thread_bytes_per_s": samples / thread * width,
    }


def _least(seconds: list[float]) -> float:
    return quantiles(seconds, n=10, method="inclusive")[0]


def ingested(
    counts: Mapping[int, Spent], part: Rollout, took_s: float, limit: float, prefix: str = ""
) -> dict[str, float]:
    """Samples/s that arrived and were joined, against the ideal and against the limit in samples/s.

    Medians over the collections, and the fastest tenth, which other work disturbed least;
    overlapped, of the means of its stretches.
    """
    figures: dict[str, float] = {}
    for actors, spent in counts.items():
        samples = actors * part.samples
        ideal = samples / took_s
        tenths = quantiles(spent.wall, n=10, method="inclusive")
        rate, undisturbed = samples / median(spent.wall), samples / tenths[0]
        found = {
            "ideal_samples_per_s": ideal,
            "samples_per_s": rate,
            "slow_tenth_samples_per_s": samples / tenths[-1],
            "fast_tenth_samples_per_s": undisturbed,
            "bytes_per_s": rate * size(part) / part.samples,
            "processor_us_per_sample": 1e6 * median(spent.processor) / samples,
            "thread_us_per_sample": 1e6 * median(spent.thread) / samples,
            "to_ideal_ratio": rate / ideal,
            "to_reachable_ratio": rate / min(ideal, limit),
            "fast_tenth_to_ideal_ratio": undisturbed / ideal,
            "fast_tenth_to_reachable_ratio": undisturbed / min(ideal, limit),
        }
        figures |= {f"{prefix}actors_{actors}_{name}": value for name, value in found.items()}
    return figures


def updating(experiment: Experiment, part: Rollout) -> float:
    """Seconds of an update on the rollouts of all actors: the quickest of some."""
    whole = Rollout.join([replace(part, first_scene=i) for i in range(OVERLAPPING)])
    student = assembly.learner(experiment)
    spent = []
    for _ in range(8):
        began = time.perf_counter()
        student.update(whole, whole.rewards, student.sigma)
        spent.append(time.perf_counter() - began)
    student.close()
    return min(spent)


def overlapping(experiment: Experiment, fleet: SleepingFleet, seconds: float) -> dict[str, float]:
    """An iteration of the loop, overlapped, against the longer of its two halves.

    Both halves are those of a lockstep run of the same; medians of alternating stretches.
    """
    lockstep: list[dict[str, float]] = []
    overlapped: list[dict[str, float]] = []
    for _ in range(ROUNDS):
        for lines, overlap in ((lockstep, False), (overlapped, True)):
            loop = Loop(
                assembly.learner(experiment),
                fleet,
                None,
                _Nowhere(),
                _Nowhere(),
                LoopConfig(lag=LagConfig(overlap)),
            )
            lines += iterations(loop, seconds / ROUNDS / 2)
            loop.close()

    def middle(lines: list[dict[str, float]], part: str) -> float:
        return median(line[f"rate/{part}_s"] for line in lines)

    gather, update = middle(lockstep, "gather"), middle(lockstep, "update")
    whole, ahead = middle(lockstep, "iteration"), middle(overlapped, "iteration")
    return {
        "gather_s": gather,
        "update_s": update,
        "lockstep_s": whole,
        "overlapped_s": ahead,
        "lockstep_to_longer_ratio": whole / max(gather, update),
        "overlapped_to_longer_ratio": ahead / max(gather, update),
        "update_samples_per_s": fleet.samples / update,
    }


def iterations(loop: Loop, seconds: float) -> list[dict[str, float]]:
    """The metrics of iterations over so many seconds, at least four, after two to settle."""
    for _ in range(2):
        loop.iterate()
    lines: list[dict[str, float]] = []
    began = time.perf_counter()
    while len(lines) < 4 or time.perf_counter() - began < seconds:
        lines.append(loop.iterate())
    return lines


class _Nowhere:
    """Keeps no records and no checkpoints."""

    def record(self, iteration: int, metrics: Any) -> None:
        """Nothing."""

    def save(self, iteration: int, state: Any, best: bool = False) -> None:
        """Nothing."""

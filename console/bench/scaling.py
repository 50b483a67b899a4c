"""`inhabit bench scaling`: the learner's intake from many actors, and the gain of overlapping.

The actors are stand-ins that sleep for the measured computing time of a real actor, so that two
cores can run hundreds. All traffic is real: weights through the object store, rollouts of full
size. The learner's limit is measured apart, on finished rollouts while no other process computes.
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
from console.plan.estimate import Costs, Fleet, estimate
from console.run import assembly
from console.run.experiment import Experiment
from console.terminal import progress
from learner.config import LagConfig, LoopConfig
from learner.loop import Loop
from policy.rollout import Rollout

ACTORS = (1, 2, 4, 16, 64, 200)
PROCESSES = 4
"""Processes that hold the actors: each takes some 100 MB and seconds to start."""
OVERLAPPING = 4
"""Number of actors in the comparison of lockstep and overlapped."""
RATIOS = (0.5, 1.0, 2.0)
"""Rollout times in this comparison, in units of the update's time."""
ROUNDS = 3
"""Number of rounds of all measurements, against varying other load on the machine."""
OBJECT_STORE_BYTES = 2**31
_LIMIT = "limit_samples_per_s"


@dataclass
class Spent:
    """Seconds of each collection: wall time, processor time of the learner's process, which has
    Ray's threads, and processor time of the learner's thread.
    """

    wall: list[float] = field(default_factory=list)
    processor: list[float] = field(default_factory=list)
    thread: list[float] = field(default_factory=list)

    @contextmanager
    def one(self) -> Iterator[None]:
        """Time the block as one collection."""
        began = _clocks()
        yield
        self.add(began, 1)

    def add(self, began: tuple[float, float, float], count: int) -> None:
        """Add `count` collections since `began` as one entry, their mean."""
        kinds = self.wall, self.processor, self.thread
        for kind, a, b in zip(kinds, began, _clocks(), strict=True):
            kind.append((b - a) / count)


def _clocks() -> tuple[float, float, float]:
    return time.perf_counter(), time.process_time(), time.thread_time()


def measure(experiment: Experiment, scenes: int, seconds: float) -> dict[str, float]:
    """Return the intake by number of actors, against the ideal and the learner's limit, lockstep
    and overlapped.

    scenes: of an actor. seconds: time of each measurement.
    """
    experiment = replace(experiment, ppo=replace(experiment.ppo, warmup_iterations=0))
    part, took_s = real_part(experiment, scenes, seconds)
    student = assembly.learner(experiment)
    weights = student.weights()
    student.close()
    with (
        ray_session(cpus=PROCESSES, object_store_bytes=OBJECT_STORE_BYTES),
        sleepers(part, PROCESSES) as hosts,
        # each takes `seconds`
        progress("measurements", 2 * len(ACTORS) + 1 + len(RATIOS)) as note,
    ):
        lockstep = {actors: Spent() for actors in ACTORS}
        ahead = {actors: Spent() for actors in ACTORS}
        ready, received = Spent(), Spent()
        for turn in range(ROUNDS):
            for place, actors in enumerate(ACTORS):
                fleet = SleepingFleet(hosts, part, actors, took_s)
                collect(fleet, weights, seconds / ROUNDS, lockstep[actors])
                collect_ahead(fleet, weights, seconds / ROUNDS, ahead[actors])
                note((turn * (2 * len(ACTORS) + 1) + 2 * (place + 1)) / ROUNDS)
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
        limit = figures[_LIMIT]
        figures |= ingested(lockstep, part, took_s, limit, "lockstep_")
        figures |= ingested(ahead, part, took_s, limit)
        figures |= planned(experiment, part, took_s, figures)
        update_s = updating(experiment, part)
        for place, ratio in enumerate(RATIOS):
            note(2 * len(ACTORS) + 1 + place)
            fleet = SleepingFleet(hosts, part, OVERLAPPING, ratio * update_s)
            found = overlapping(experiment, fleet, seconds)
            figures |= {f"actors_at_{ratio:g}_{name}": value for name, value in found.items()}
    return figures


def real_part(experiment: Experiment, scenes: int, seconds: float) -> tuple[Rollout, float]:
    """Return a real actor's rollout of a number of scenes, and its processor time, s.

    Processor time does not depend on other load on this machine.
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
    """Return the bytes of a rollout's tensors."""
    return sum(t.numel() * t.element_size() for t in rollout.tensors().values())


def collect(
    fleet: SleepingFleet, weights: Mapping[str, Tensor], seconds: float, spent: Spent
) -> None:
    """Collect in lockstep for a time and at least four times, without updates."""
    fleet.collect(weights, 0, 0.0)
    began, count = time.perf_counter(), 0
    while count < 4 or time.perf_counter() - began < seconds:
        with spent.one():
            fleet.collect(weights, count, 0.0)
        count += 1


def collect_ahead(
    fleet: SleepingFleet, weights: Mapping[str, Tensor], seconds: float, spent: Spent
) -> None:
    """Collect overlapped: actors get the next request before they finish, as in `Gathering`.

    Adds one entry, the mean, as a long collection shortens the next one.
    """
    under_way = fleet.request(weights, 0)
    began, count = _clocks(), 0
    while count < 6 or time.perf_counter() - began[0] < seconds:
        count += 1
        coming = fleet.request(weights, count)
        fleet.receive(under_way)
        under_way = coming
        if count == 2:
            began = _clocks()
    spent.add(began, count - 2)
    fleet.receive(under_way)


def take_ready(
    fleet: SleepingFleet,
    weights: Mapping[str, Tensor],
    seconds: float,
    ready: Spent,
    received: Spent,
) -> None:
    """Take finished rollouts and request the next ones, while all actors sleep.

    received: time of Ray's threads in this process until the rollouts are received.
    """
    waiting = fleet.request(weights, 0)
    began, count = time.perf_counter(), 0
    while count < 2 or time.perf_counter() - began < seconds:
        with received.one():
            ray.wait(waiting, num_returns=len(waiting))
        with ready.one():
            coming = fleet.request(weights, count + 1)
            fleet.receive(waiting)
        waiting, count = coming, count + 1
    fleet.receive(waiting)


def limits(ready: Spent, received: Spent, samples: int, width: float) -> dict[str, float]:
    """Return the limits of a learner on one core, and of one whose Ray threads have another core.

    samples: of a collection. width: bytes of a sample. From the processor time of the fastest tenth
    of the collections, because other load also slows the processor's caches.
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
    """Return samples/s received and joined, against the ideal and the limit in samples/s.

    Medians over the collections, and their fastest tenth, which other load disturbed least; for
    overlapped ones, over the means of rounds.
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


def planned(
    experiment: Experiment, part: Rollout, took_s: float, figures: Mapping[str, float]
) -> dict[str, float]:
    """Return the rates that `inhabit plan` estimates, relative to those measured in `figures`.

    Both without update and style; the plan knows an actor's time and the learner's limit.
    """
    costs = Costs(took_s / part.samples, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0 / figures[_LIMIT])
    found = {}
    for actors in ACTORS:
        for prefix, overlap in (("lockstep_", False), ("", True)):
            fleet = Fleet(
                actors,
                actors * part.scenes,
                part.horizon,
                experiment.ppo.epochs,
                experiment.ppo.hidden,
                part.goals.shape[-1],
                style=False,
                overlap=overlap,
                gbit_per_s=1e6,
            )
            name = f"{prefix}actors_{actors}"
            rate = estimate(fleet, costs).samples_per_s
            found[f"{name}_plan_to_measured_ratio"] = rate / figures[f"{name}_samples_per_s"]
    return found


def updating(experiment: Experiment, part: Rollout) -> float:
    """Return the seconds of an update on the rollouts of all actors: the fastest of eight."""
    whole = Rollout.join([replace(part, first_scene=i * part.scenes) for i in range(OVERLAPPING)])
    student = assembly.learner(experiment)
    spent = []
    for _ in range(8):
        began = time.perf_counter()
        student.update(whole, whole.rewards, student.sigma)
        spent.append(time.perf_counter() - began)
    student.close()
    return min(spent)


def overlapping(experiment: Experiment, fleet: SleepingFleet, seconds: float) -> dict[str, float]:
    """Return the time of an overlapped iteration against the longer of gathering and update.

    Both parts are measured in lockstep; medians of alternating rounds.
    """
    lockstep: list[dict[str, float]] = []
    overlapped: list[dict[str, float]] = []
    for _ in range(ROUNDS):
        for lines, overlap in ((lockstep, False), (overlapped, True)):
            loop = Loop(
                assembly.learner(experiment),
                fleet,
                None,
                _Null(),
                _Null(),
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
    """Return the metrics of iterations over a time, at least four, after two of warm-up."""
    for _ in range(2):
        loop.iterate()
    lines: list[dict[str, float]] = []
    began = time.perf_counter()
    while len(lines) < 4 or time.perf_counter() - began < seconds:
        lines.append(loop.iterate())
    return lines


class _Null:
    """A recorder and checkpoint store that discards everything."""

    def record(self, iteration: int, metrics: Any) -> None:
        """Discard metrics."""

    def save(self, iteration: int, state: Any, best: bool = False) -> None:
        """Discard a checkpoint."""

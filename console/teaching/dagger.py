"""DAgger (Ross et al., "A reduction of imitation learning and structured prediction to no-regret
online learning", 2011), of `inhabit distill`.

Student and teacher drive in turn, the student for growing stretches. The teacher labels every
visited state, and the student is regressed on all labels. Worker processes simulate and label while
this process regresses, on a GPU if available.
"""

import contextlib
import json
import math
import queue
import signal
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import torch
import torch.multiprocessing as mp
from torch import Tensor

from console.commands.teaching import Dagger
from console.run import assembly
from console.run.experiment import Experiment
from console.teaching.regression import Regression, Samples, action_weights
from console.terminal import doing, progress
from learner.ppo import Learner
from policy.checkpoints.format import Manifest, write
from policy.model.acting import Policy
from world.errors import InhabitError
from world.partial_files import replacing

#: Batches between two checks of the time; seconds between two reports, and two checkpoints.
_CHUNK, _REPORT_S, _SAVE_S = 50, 20.0, 60.0
#: Seconds between two lines while the first samples are collected; time without labels that ends
#: the training.
_FIRST_S, _SILENCE_S = 2.0, 120.0
#: Seconds between two looks of a worker with a full queue for the process that empties it.
_ALIVE_S = 2.0


class TeachingError(InhabitError):
    """Worker processes that ended or send no labels."""


class Labelling(Protocol):
    """Scenes that a student and a teacher drive in turn."""

    def collect(self, student: Policy | None, spell: float) -> tuple[Tensor, Tensor, Tensor]:
        """Return observations [m, d] and teacher actions [m, 28] of the next control steps, in
        which the student drives for about `spell` steps at a time; and for each ended episode [k,
        3 + S] whether the student drove it alone, its length, whether it ended in a fall, its S
        stages."""
        ...


@dataclass(frozen=True)
class Lesson:
    """What is taught: the scenes, the student, and what is said of the checkpoint."""

    scenes: Sequence[Callable[[], Labelling]]
    """Of each worker process: makes its scenes; can be pickled."""
    experiment: Experiment
    """Of the checkpoint."""
    learner: Learner
    """The student: new, or with the networks that it begins from."""
    begun: bool
    """The student can drive from the first step on."""
    stages: tuple[str, ...]
    """Stages of the task, in the order of what the scenes report."""
    notes: Mapping[str, str]
    """Notes of the checkpoint."""


@dataclass(frozen=True)
class Workers:
    """The processes that simulate and label, with their connections."""

    labels: Any
    """Queue of (observations, teacher actions, ended episodes), NumPy arrays."""
    spell: Any
    """Shared number of control steps that the student drives at a time."""
    student: Path
    """File of the student's newest weights."""
    processes: Sequence[Any]

    def check(self) -> None:
        """Raise TeachingError where a process has ended."""
        for process in self.processes:
            if not process.is_alive():
                raise TeachingError(f"a worker process ended with exit code {process.exitcode}")


def work(make: Callable[[], Labelling], labels: Any, spell: Any, weights: Path) -> None:
    """Simulate and label with the newest student in the file `weights`, as long as the process that
    learns from it is there; a process."""
    # Ctrl-C reaches the whole process group; the parent terminates its workers
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    torch.set_num_threads(1)
    scenes, student, stamp = make(), None, 0
    learns = mp.parent_process()
    while learns is None or learns.is_alive():
        if weights.exists() and weights.stat().st_mtime_ns != stamp:
            stamp = weights.stat().st_mtime_ns
            student = Policy(torch.load(weights, weights_only=True))
        found = scenes.collect(student, spell.value)
        _put(labels, [part.numpy() for part in found], learns)
    labels.cancel_join_thread()  # it would wait for a reader for ever


def _put(labels: Any, found: Sequence[Any], learns: Any) -> None:
    """Queue labels once there is room, unless nobody takes them any more."""
    while learns is None or learns.is_alive():
        with contextlib.suppress(queue.Full):
            labels.put(found, timeout=_ALIVE_S)
            return


def save(out: Path, lesson: Lesson, samples: int, lines: list[dict[str, float]]) -> None:
    """Write the networks as a checkpoint with its metrics. The critic is untrained; PPO's warm-up
    trains it first."""
    manifest = Manifest(assembly.layout(lesson.experiment), 0, samples, dict(lesson.notes))
    write(out, {"policy": lesson.learner.policy_state()}, manifest)
    (out / "metrics.jsonl").write_text("".join(f"{json.dumps(line)}\n" for line in lines))


def teach(out: Path, settings: Dagger, lesson: Lesson) -> None:
    """Collect labels and regress until the limit of time or batches; the checkpoint is `out`."""
    context = mp.get_context("spawn")
    count = len(lesson.scenes)
    labels, spell = context.Queue(4 * count), context.Value("d", settings.spell[0])
    out.parent.mkdir(parents=True, exist_ok=True)
    # a folder of our own: the workers load whatever is there
    shared = tempfile.TemporaryDirectory(
        prefix=f".{out.name}.", dir=out.parent, ignore_cleanup_errors=True
    )
    student = Path(shared.name) / "student"
    if lesson.begun:
        _publish(lesson.learner, student)
    processes = [
        context.Process(target=work, args=(make, labels, spell, student), daemon=True)
        for make in lesson.scenes
    ]
    for process in processes:
        process.start()
    try:
        _regress(out, settings, lesson, Workers(labels, spell, student, processes))
    finally:
        for process in processes:
            process.terminate()
            process.join()
        shared.cleanup()
        lesson.learner.close()


def _regress(out: Path, settings: Dagger, lesson: Lesson, workers: Workers) -> None:
    weights = action_weights(lesson.experiment.world)
    regression = Regression(lesson.learner, weights, settings.rate, settings.batch)
    width = assembly.layout(lesson.experiment).observation
    canonical = lesson.learner.canonical
    samples = Samples(settings.capacity, width, regression.device, canonical)
    _fill(samples, workers, settings.first)
    with doing("fitting the normaliser"):
        regression.begin(
            samples.observations[: samples.total], samples.teacher_actions[: samples.total]
        )
    began = reported = saved = time.monotonic()
    lines: list[dict[str, float]] = []
    errors, ended = [], []

    def keep() -> None:
        regression.updated_learner()
        save(out, lesson, samples.total, lines)

    def stage() -> str:
        batches = f" of {settings.batches}" if settings.batches else ""
        minutes = (time.monotonic() - began) / 60.0
        return (
            f"training the student, batch {regression.steps}{batches},"
            f" {minutes:.1f} of {settings.minutes:g} min"
        )

    try:
        while (done := _progress(settings, began, regression.steps)) < 1.0:
            ended += _take(samples, workers)
            rate = 1e-6 + settings.rate * 0.5 * (1.0 + math.cos(math.pi * done))
            with doing(stage):
                chunk = range(_chunk(settings, regression))
                errors += [regression.step(samples, rate) for _ in chunk]
            first, last = settings.spell
            workers.spell.value = first * (last / first) ** done
            now = time.monotonic()
            over = _progress(settings, began, regression.steps) >= 1.0
            if now - reported > _REPORT_S or over:
                workers.check()
                lines.append(
                    {
                        "minutes": (now - began) / 60.0,
                        "samples": samples.total,
                        "batches": regression.steps,
                        "error": math.sqrt(float(torch.stack(errors).mean())),
                        "spell": workers.spell.value,
                        **_report(ended, lesson.stages),
                    }
                )
                print(described(lines[-1], settings.minutes), flush=True)
                errors, ended, reported = [], [], now
                _publish(regression.updated_learner(), workers.student)
            if now - saved > _SAVE_S:
                keep()
                saved = now
    finally:
        keep()
    print(f"{out}: {samples.total} samples, {regression.steps} batches")


def described(line: Mapping[str, float], minutes: float) -> str:
    """Return a line of metrics as text: how far it is, and how the student does alone."""
    parts = [
        f"{line['minutes']:.1f} of {minutes:g} min",
        f"{line['samples']:,.0f} labels",
        f"error {line['error']:.3f}",
        f"student drives {line['spell']:.0f} steps at a time",
    ]
    alone = {
        name.removeprefix("student/"): value
        for name, value in line.items()
        if name.startswith("student/")
    }
    if episodes := alone.pop("episodes", 0):
        alone.pop("steps")
        shares = ", ".join(f"{name} {100.0 * value:.0f} %" for name, value in alone.items())
        parts.append(f"alone in {episodes:.0f} episodes: {shares}")
    return "  ".join(parts)


def _progress(settings: Dagger, began: float, steps: int) -> float:
    """Return the elapsed fraction of the time or of the batches, the larger one."""
    time_over = (time.monotonic() - began) / (60.0 * settings.minutes)
    return max(time_over, steps / settings.batches if settings.batches else 0.0)


def _chunk(settings: Dagger, regression: Regression) -> int:
    """Return the number of batches until the next check of the time."""
    return min(_CHUNK, settings.batches - regression.steps) if settings.batches else _CHUNK


def _publish(learner: Learner, weights: Path) -> None:
    """Publish the student's weights to the workers."""
    with replacing(weights) as partial:
        torch.save(learner.averaged_weights(), partial)


def _fill(samples: Samples, workers: Workers, first: int) -> None:
    """Collect the first samples."""
    print(f"collecting the first {first} samples", flush=True)
    received = reported = time.monotonic()

    def stage() -> str:
        return "collecting labels" if samples.total else "the workers build their scenes"

    with progress("samples", first, stage) as update:
        while samples.total < first:
            now = time.monotonic()
            if _take(samples, workers, wait_s=1.0):
                received = now
                update(samples.total)
            else:
                workers.check()
                if now - received > _SILENCE_S:
                    raise TeachingError(f"no labels from the workers for {_SILENCE_S:.0f} s")
            if samples.total and now - reported > _FIRST_S:
                print(f"{samples.total} of {first} samples", flush=True)
                reported = now


def _take(samples: Samples, workers: Workers, wait_s: float | None = None) -> list[Tensor]:
    """Add the queued labels, or the next ones within `wait_s`; return the ended episodes."""
    ended = []
    while True:
        try:
            found = workers.labels.get(wait_s is not None, wait_s)
        except queue.Empty:
            return ended
        observations, actions, ends = (torch.from_numpy(part) for part in found)
        samples.add(observations, actions)
        ended.append(ends)
        if wait_s is not None:
            return ended


def _report(ended: list[Tensor], stages: Sequence[str]) -> dict[str, float]:
    """Return the figures of the episodes that the student drove alone, and of the others."""
    names = ("steps", "fell", *stages)
    facts = torch.cat(ended) if ended else torch.zeros(0, 3 + len(stages))
    found: dict[str, float] = {}
    for group, some in (("student", facts[facts[:, 0] > 0]), ("mixed", facts[facts[:, 0] == 0])):
        if len(some):
            found[f"{group}/episodes"] = len(some)
            means = zip(names, some[:, 1:].mean(dim=0).tolist(), strict=True)
            found |= {f"{group}/{name}": mean for name, mean in means}
    return found

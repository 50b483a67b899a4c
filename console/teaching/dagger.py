"""`inhabit teach carry`: DAgger (Ross et al., "A reduction of imitation learning and structured
prediction to no-regret online learning", 2011).

Student and scripted teacher drive in turn, the student for growing stretches. The teacher labels
every visited state, and the student is regressed on all labels. Worker processes simulate and label
while this process regresses, on a GPU if available.
"""

import json
import math
import queue
import signal
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import torch
import torch.multiprocessing as mp
from torch import Tensor

from console.commands.teaching import Practice, TeachCarry
from console.run import assembly
from console.run.directory import checkpoint_folder
from console.run.experiment import Experiment, to_json
from console.teaching.regression import Regression, Samples, action_weights
from console.teaching.scenes import TeachingScenes
from learner.config import LearnerConfig
from learner.ppo import Learner
from policy.checkpoints import lineage
from policy.checkpoints.format import Manifest, read, read_manifest, write
from policy.checkpoints.lineage import Origin
from policy.checkpoints.transfer import widened
from policy.model.acting import Policy
from world.config import WorldConfig
from world.errors import InhabitError
from world.partial_files import replacing
from world.tasks.carry import Carry

#: Batches between two checks of the time; seconds between two reports, and two checkpoints.
_CHUNK, _REPORT_S, _SAVE_S = 50, 20.0, 60.0
#: Seconds between two lines while the first samples are collected; time without labels that ends
#: the training.
_FIRST_S, _SILENCE_S = 2.0, 120.0
_TEACHER = Origin("a scripted teacher (world.teachers.carry), no motion capture", "Apache-2.0")


class TeachingError(InhabitError):
    """Worker processes that ended or send no labels."""


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


def experiment_of(command: TeachCarry) -> Experiment:
    """Return the experiment of the checkpoint."""
    world = WorldConfig(task="carry", episode_s=Carry.episode_s)
    ppo = LearnerConfig(hidden=command.hidden, skip=True, observation_clip=10.0)
    return Experiment(seed=command.practice.seed, world=world, ppo=ppo)


def work(practice: Practice, world: WorldConfig, labels: Any, spell: Any, weights: Path) -> None:
    """Simulate and label without end, with the newest student in the file `weights`; a process."""
    # Ctrl-C reaches the whole process group; the parent terminates its workers
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    torch.set_num_threads(1)
    scenes, student, stamp = TeachingScenes(practice, world), None, 0
    while True:
        if weights.exists() and weights.stat().st_mtime_ns != stamp:
            stamp = weights.stat().st_mtime_ns
            student = Policy(torch.load(weights, weights_only=True))
        found = scenes.collect(student, spell.value)
        labels.put([part.numpy() for part in found])


def save(
    out: Path,
    experiment: Experiment,
    learner: Learner,
    samples: int,
    lines: list[dict[str, float]],
    inherited: Sequence[Origin] = (),
) -> None:
    """Write the networks as a checkpoint with its metrics. The critic is untrained; PPO's warm-up
    trains it first.

    inherited: origins of the policies that the student begins from and learns from.
    """
    notes = {
        "experiment": json.dumps(to_json(experiment)),
        lineage.NOTE: lineage.note((_TEACHER, *inherited)),
    }
    manifest = Manifest(assembly.layout(experiment), 0, samples, notes)
    write(out, {"policy": learner.policy_state()}, manifest)
    (out / "metrics.jsonl").write_text("".join(f"{json.dumps(line)}\n" for line in lines))


def teach(command: TeachCarry) -> None:
    """Collect labels and regress until the limit of time or batches."""
    experiment = experiment_of(command)
    learner = initialised(command, experiment)
    context = mp.get_context("spawn")
    labels, spell = context.Queue(4 * command.workers), context.Value("d", command.spell[0])
    command.out.parent.mkdir(parents=True, exist_ok=True)
    # a folder of our own: the workers load whatever is there
    shared = tempfile.TemporaryDirectory(
        prefix=f".{command.out.name}.", dir=command.out.parent, ignore_cleanup_errors=True
    )
    student = Path(shared.name) / "student"
    if command.init is not None:
        _publish(learner, student)
    seed = command.practice.seed
    processes = [
        context.Process(
            target=work,
            args=(
                replace(command.practice, seed=seed + 1000 * k),
                experiment.world,
                labels,
                spell,
                student,
            ),
            daemon=True,
        )
        for k in range(command.workers)
    ]
    for process in processes:
        process.start()
    try:
        _regress(command, experiment, learner, Workers(labels, spell, student, processes))
    finally:
        for process in processes:
            process.terminate()
            process.join()
        shared.cleanup()
        learner.close()


def initialised(command: TeachCarry, experiment: Experiment) -> Learner:
    """Return the initial learner: new, or with the networks of `init`."""
    learner = assembly.learner(experiment)
    if command.init is not None:
        found = read(checkpoint_folder(command.init), ("policy",))
        mine, theirs = assembly.layout(experiment), found.manifest.layout
        source = str(command.init)
        replace(mine, hidden=theirs.hidden).require(theirs, source)
        policy = widened(found.state["policy"], command.hidden, experiment.seed, source)
        learner.load_policy_state({**policy, "actor": policy["average"]})
    return learner


def _regress(
    command: TeachCarry, experiment: Experiment, learner: Learner, workers: Workers
) -> None:
    begun = (command.init, command.practice.walker)
    terms = [
        origin
        for source in begun
        if source is not None
        for origin in lineage.of(read_manifest(checkpoint_folder(source)).notes)
    ]
    regression = Regression(learner, action_weights(experiment.world), command.rate, command.batch)
    width = assembly.layout(experiment).observation
    samples = Samples(command.capacity, width, regression.device)
    _fill(samples, workers, command.first)
    regression.begin(
        samples.observations[: samples.total], samples.teacher_actions[: samples.total]
    )
    began = reported = saved = time.monotonic()
    lines: list[dict[str, float]] = []
    errors, ended = [], []
    try:
        while (done := _progress(command, began, regression.steps)) < 1.0:
            ended += _take(samples, workers)
            rate = 1e-6 + command.rate * 0.5 * (1.0 + math.cos(math.pi * done))
            errors += [regression.step(samples, rate) for _ in range(_chunk(command, regression))]
            first, last = command.spell
            workers.spell.value = first * (last / first) ** done
            now = time.monotonic()
            over = _progress(command, began, regression.steps) >= 1.0
            if now - reported > _REPORT_S or over:
                workers.check()
                lines.append(
                    {
                        "minutes": (now - began) / 60.0,
                        "samples": samples.total,
                        "batches": regression.steps,
                        "error": math.sqrt(float(torch.stack(errors).mean())),
                        "spell": workers.spell.value,
                        **_report(ended),
                    }
                )
                text = ", ".join(f"{name} {value:.6g}" for name, value in lines[-1].items())
                print(text, flush=True)
                errors, ended, reported = [], [], now
                _publish(regression.updated_learner(), workers.student)
            if now - saved > _SAVE_S:
                save(
                    command.out,
                    experiment,
                    regression.updated_learner(),
                    samples.total,
                    lines,
                    terms,
                )
                saved = now
    finally:
        save(command.out, experiment, regression.updated_learner(), samples.total, lines, terms)
    print(f"{command.out}: {samples.total} samples, {regression.steps} batches")


def _progress(command: TeachCarry, began: float, steps: int) -> float:
    """Return the elapsed fraction of the time or of the batches, the larger one."""
    time_over = (time.monotonic() - began) / (60.0 * command.minutes)
    return max(time_over, steps / command.batches if command.batches else 0.0)


def _chunk(command: TeachCarry, regression: Regression) -> int:
    """Return the number of batches until the next check of the time."""
    return min(_CHUNK, command.batches - regression.steps) if command.batches else _CHUNK


def _publish(learner: Learner, weights: Path) -> None:
    """Publish the student's weights to the workers."""
    with replacing(weights) as partial:
        torch.save(learner.averaged_weights(), partial)


def _fill(samples: Samples, workers: Workers, first: int) -> None:
    """Collect the first samples."""
    print(f"collecting the first {first} samples", flush=True)
    received = reported = time.monotonic()
    while samples.total < first:
        now = time.monotonic()
        if _take(samples, workers, wait_s=1.0):
            received = now
        else:
            workers.check()
            if now - received > _SILENCE_S:
                raise TeachingError(f"no labels from the workers for {_SILENCE_S:.0f} s")
        if now - reported > _FIRST_S:
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


def _report(ended: list[Tensor]) -> dict[str, float]:
    """Return the figures of the episodes that the student drove alone, and of the others."""
    names = ("steps", "fell", *Carry.stages)
    facts = torch.cat(ended) if ended else torch.zeros(0, 3 + len(Carry.stages))
    found: dict[str, float] = {}
    for group, some in (("student", facts[facts[:, 0] > 0]), ("mixed", facts[facts[:, 0] == 0])):
        if len(some):
            found[f"{group}/episodes"] = len(some)
            means = zip(names, some[:, 1:].mean(dim=0).tolist(), strict=True)
            found |= {f"{group}/{name}": mean for name, mean in means}
    return found

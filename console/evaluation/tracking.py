"""Evaluation of tracking: completed share of the episodes, errors, contacts and ends."""

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
import torch
from numpy.typing import NDArray
from rich.table import Table
from torch import Tensor

from console.evaluation.scores import proportion
from console.evaluation.tables import number
from console.recording.format import Recording, Take, boxes_of
from console.run import assembly
from console.run.directory import run_of
from policy.checkpoints import lineage
from policy.model.acting import Policy
from world import random_streams
from world.character import model as character
from world.config import WorldConfig
from world.scene.batch import Scenes
from world.scene.box import STAND, is_box
from world.scene.target import state
from world.tasks.track import Track
from world.tracking.bank import TrackBank
from world.tracking.sampler import TrackSampler
from world.tracking.target import TrackTarget, deviation, touching, tracked

ENDS = Track.stages
#: Trials that follow one another in the same scenes, and those scenes: fixed, so that no figure
#: depends on the number of threads.
CHUNK, SLOTS = 512, 64


@dataclass(frozen=True)
class Trials:
    """Initial states of m trials."""

    frame: NDArray[np.int64]
    """[m]: of the reference."""
    choice: NDArray[np.float64]
    """[m] in [0, 1): which of the clip's boxes."""
    whole: NDArray[np.bool_]
    """[m]: the trial starts at the clip's first sound frame; false: at a random one."""


@dataclass(frozen=True)
class Outcomes:
    """Outcomes of m trials."""

    completed: NDArray[np.bool_]
    ends: NDArray[np.bool_]
    """[m, 4]: which of ENDS ended the trials that are not completed."""
    steps: NDArray[np.int64]
    """[m]: control steps until then."""
    deviation: NDArray[np.float64]
    """[m, 3]: means over these of the body's, the root's and the box's deviations, m."""
    contact: NDArray[np.int64]
    """[m, 3]: true positive, false positive and false negative control steps of both hands touching
    the box, against the reference."""
    takes: list[Take]
    """Of the first trials, as many as were to be recorded."""


def bank_of(world: WorldConfig) -> TrackBank:
    """Return the bank of a configuration's clips."""
    return cast("TrackBank", assembly.training_bank(world))


def manifest(bank: TrackBank, trials: int, seed: int) -> Trials:
    """Trials of a seed: clips in turn, from any sound frame; then each clip from its first one,
    once with each of its boxes."""
    reference = bank.reference
    u = (
        random_streams.uniform(seed, random_streams.CLIP_TRIAL, torch.arange(trials), 0, 2)
        .double()
        .numpy()
    )
    sound = reference.start_weight.numpy() > 0.0
    pools = [
        np.flatnonzero(sound[int(a) : int(b)]) + int(a)
        for a, b in zip(reference.first, reference.stop, strict=True)
    ]
    pools = [pool for pool in pools if len(pool)]
    whole = pools
    if trials < len(pools):  # clips from all over the list, not its first ones
        pools = [pools[i * len(pools) // trials] for i in range(trials)]
    frame = [
        pools[i % len(pools)][int(x * len(pools[i % len(pools)]))] for i, x in enumerate(u[:, 0])
    ]
    frame += [pool[0] for pool in whole for _ in range(bank.each)]
    boxes = [(k + 0.5) / bank.each for _ in whole for k in range(bank.each)]
    return Trials(
        np.array(frame, np.int64),
        np.concatenate((u[:, 1], boxes)),
        np.arange(len(frame)) >= trials,
    )


def run(
    world: WorldConfig,
    bank: TrackBank,
    weights: dict[str, Tensor] | None,
    trials: Trials,
    threads: int,
    record: int = 0,
    progress: Callable[[int], None] = lambda done: None,
) -> Outcomes:
    """Follow the clips with the policy's mean actions (None: actions of 0); the first `record`
    trials, at most SLOTS, are recorded."""
    torch.set_num_threads(1)
    policy = None if weights is None else Policy(weights)
    every = np.arange(len(trials.frame))
    chunks = [every[i : i + CHUNK] for i in range(0, len(every), CHUNK)]
    done = 0

    def one(rows: NDArray[np.int64]) -> Outcomes:
        nonlocal done
        torch.set_num_threads(1)
        recorded = min(record, SLOTS, len(rows)) if rows[0] == 0 else 0
        found = _Chunk(world, bank, policy, trials, rows, recorded).run()
        done += len(rows)
        progress(min(done, int((~trials.whole).sum())))
        return found

    with ThreadPoolExecutor(threads, "trials") as pool:
        parts = list(pool.map(one, chunks))
    return Outcomes(
        np.concatenate([part.completed for part in parts]),
        np.concatenate([part.ends for part in parts]),
        np.concatenate([part.steps for part in parts]),
        np.concatenate([part.deviation for part in parts]),
        np.concatenate([part.contact for part in parts]),
        [take for part in parts for take in part.takes],
    )


class _Chunk:
    """Trials in a fixed number of scenes: as a trial ends the next begins in its scene, so that no
    scene waits for the longest clip."""

    def __init__(
        self,
        world: WorldConfig,
        bank: TrackBank,
        policy: Policy | None,
        trials: Trials,
        rows: NDArray[np.int64],
        record: int,
    ) -> None:
        self._bank, self._policy, self._record = bank, policy, record
        self._sampler, self._task = TrackSampler(world, bank, 0), Track()
        self._frame = torch.from_numpy(trials.frame[rows])
        self._choice = torch.from_numpy(trials.choice[rows]).float()
        left = bank.reference.stop[bank.reference.clip[self._frame]] - self._frame
        # those that are recorded first, then the longest: the last ones to begin are short
        shown = torch.arange(len(rows)) < record
        order = torch.argsort(torch.where(shown, -(1 << 40), -left), stable=True)
        n = min(SLOTS, len(rows))
        self._trial, self._waiting = order[:n].clone(), order[n:].tolist()[::-1]
        states = self._sampler.at(self._frame[self._trial], self._choice[self._trial])
        models = [bank.models[v] for v in states.variant.tolist()]
        self._scenes = Scenes(models, world.action_scale, world.action_clip)
        self._targets = self._sampler.target(states)
        self._sampler.apply(self._scenes, torch.arange(n), states)
        self._variant = states.variant
        m = len(rows)
        self._completed, self._ends = torch.zeros(m, dtype=torch.bool), torch.zeros(m, 4) > 0
        self._steps = torch.zeros(m, dtype=torch.int64)
        self._total = torch.zeros(m, 3, dtype=torch.float64)
        self._contact = torch.zeros(m, 3, dtype=torch.int64)

    def run(self) -> Outcomes:
        """Step until every trial has ended."""
        running = torch.ones(len(self._trial), dtype=torch.bool)
        kept: list[dict[str, Tensor]] = []
        while bool(running.any()):
            if self._record and bool((running & (self._trial < self._record)).any()):
                kept.append(_kept(self._scenes, self._bank, self._targets, self._record))
            over = self._step(running)
            for slot in torch.nonzero(over).flatten().tolist():
                if self._waiting:
                    self._begin(slot, self._waiting.pop())
                else:
                    running[slot] = False
        steps = self._steps
        takes = [
            _take(kept, i, int(steps[i]), self._bank, int(self._variant[i]))
            for i in range(self._record)
        ]
        return Outcomes(
            self._completed.numpy(),
            self._ends.numpy(),
            steps.numpy(),
            (self._total / steps[:, None]).numpy(),
            self._contact.numpy(),
            takes,
        )

    def _begin(self, slot: int, trial: int) -> None:
        # its numbers do not depend on how many begin at a time
        row = torch.tensor([trial])
        states = self._sampler.at(self._frame[row], self._choice[row])
        self._scenes.set_models([slot], [self._bank.models[int(states.variant)]])
        self._sampler.apply(self._scenes, torch.tensor([slot]), states)
        self._targets.write(torch.tensor([slot]), self._sampler.target(states))
        self._trial[slot] = trial

    def _step(self, running: Tensor) -> Tensor:
        """Do one control step; return [n] bool: it ended a running trial."""
        task, scenes = self._task, self._scenes
        body, target = scenes.body(), tracked(scenes.now(self._targets))
        action = torch.zeros(len(running), character.NU)
        if self._policy is not None:
            action = self._policy(state(body, target), task.goal_features(body, target))
        scenes.drive(scenes.set_points(action, target.set_points()))
        sound = scenes.finite()
        body, target = scenes.body(), tracked(scenes.now(self._targets))
        target.advance(body)
        off = deviation(body, target)
        ends = task.stage(body, target)
        ends[:, 0] |= ~sound
        failed = ends.any(dim=1)
        over = target.completed()
        both, held = touching(body, target).all(dim=1), target.holds()
        hits = torch.stack((both & held, both & ~held, ~both & held), dim=1)
        rows = self._trial[running]
        self._steps[rows] += 1
        now = torch.stack((off.body, off.root, off.box), dim=1).double()
        self._total[rows] += torch.where(sound[:, None], now, 0.0)[running]
        self._contact[rows] += (hits & target.boxed()[:, None])[running]
        self._ends[rows] = ends[running]
        self._completed[rows] = (over & ~failed)[running]
        return (over | failed) & running


def _kept(scenes: Scenes, bank: TrackBank, targets: TrackTarget, record: int) -> dict[str, Tensor]:
    row = {k: v[:record] for k, v in scenes.physics().items()}
    ghost = bank.reference.qpos[targets.frame[:record]].clone()
    ghost[:, :3] += targets.origin[:record]
    return row | {"ghost": ghost}


def _take(kept: list[dict[str, Tensor]], i: int, steps: int, bank: TrackBank, variant: int) -> Take:
    """The i-th scene as a take, with the reference beside it."""

    def column(name: str) -> NDArray[np.float64]:
        return torch.stack([row[name][i] for row in kept[:steps]]).double().numpy()

    piece = bank.pieces[variant]
    cargo = is_box(piece)
    return Take(
        column("qpos")[:, : character.NQ + 7 * cargo],
        column("qvel")[:, : character.NV + 6 * cargo],
        column("ctrl"),
        column("mocap_pos")[:, 0],
        column("mocap_quat")[:, 0],
        boxes_of(STAND if cargo else piece),
        piece.name,
        1.0,
        {"clip": variant // bank.each},
        cargo=np.array(piece.boxes[0].half_m) if cargo else np.zeros(0),
        stand=column("mocap_pos")[0, 1] if cargo else np.zeros(0),
        ghost=column("ghost"),
    )


def evaluate(
    found: assembly.Trained,
    motions: tuple[str, ...],
    trials: int,
    seed: int,
    threads: int,
    record: int = 0,
    progress: Callable[[int], None] = lambda done: None,
) -> tuple[dict[str, Any], list[Take]]:
    """The figures of a policy on clips (none: those that it was trained on), and recordings."""
    began = time.perf_counter()
    world = found.experiment.world
    if motions:
        world = replace(world, motions=motions)
    bank = bank_of(world)
    chosen = manifest(bank, trials, seed)
    outcomes = run(world, bank, found.weights, chosen, threads, record, progress)
    names = [clip.name.removesuffix("~mirrored") for clip in assembly.library_of(world).clips]
    clips = [names[i] for i in bank.reference.clip[torch.from_numpy(chosen.frame)].tolist()]
    for trial, take in enumerate(outcomes.takes):
        take.meta.update(_told(outcomes, trial, clips[trial]))
    figures = {
        "task": found.task,
        "checkpoint": str(found.path),
        "iteration": found.manifest.iteration,
        "samples": found.manifest.samples,
        "trials": trials,
        "seed": seed,
        "objects": "clips",
        # names of the clips alone: figures are passed on, paths of this machine are not
        **({"motions": sorted(set(names))} if motions else {}),
        "perturbation": "none",
        "preset": "table1",
        **summary(outcomes, chosen, np.array(clips)),
    }
    return figures | {"wall_s": time.perf_counter() - began}, outcomes.takes


def notice(found: assembly.Trained, motions: Sequence[object] = ()) -> str:
    """Return a line where a published policy, with which its clips are not published, follows the
    package's own; else an empty one."""
    if motions or found.experiment.world.motions or run_of(found.path) is not None:
        return ""
    return (
        f"{found.path.name} follows the package's own clips here; it was trained on"
        f" {lineage.data(found.manifest.notes)}"
    )


def shown(found: assembly.Trained, count: int, threads: int) -> Recording:
    """Record the first `count` clips, mirror images last, followed from their first sound frames,
    with the reference."""
    world = found.experiment.world
    bank = bank_of(world)
    whole = manifest(bank, 0, 0)
    rows = np.arange(0, len(whole.frame), bank.each * (2 if world.mirror else 1))[:count]
    chosen = Trials(whole.frame[rows], whole.choice[rows], whole.whole[rows])
    outcomes = run(world, bank, found.weights, chosen, threads, len(rows))
    names = [clip.name for clip in assembly.library_of(world).clips]
    for trial, take in enumerate(outcomes.takes):
        take.meta.update(_told(outcomes, trial, names[take.meta["clip"]]))
    meta = {"task": found.task, "checkpoint": str(found.path)}
    return Recording(outcomes.takes, {"control_hz": character.CONTROL_HZ, **meta})


def _told(outcomes: Outcomes, trial: int, clip: str) -> dict[str, Any]:
    """What a recorded trial came to, for its take."""
    ends = [name for name, ended in zip(ENDS, outcomes.ends[trial], strict=True) if ended]
    return {
        "clip": clip,
        "completed": bool(outcomes.completed[trial]),
        "ends": ends,
        "body_cm": 100.0 * float(outcomes.deviation[trial, 0]),
    }


def summary(outcomes: Outcomes, trials: Trials, clips: NDArray[np.str_]) -> dict[str, Any]:
    """Figures of all trials, and by clip; a mirror image counts with its clip."""

    def part(rows: NDArray[np.bool_]) -> dict[str, Any]:
        anywhere, whole = rows & ~trials.whole, rows & trials.whole
        steps = outcomes.steps[anywhere].astype(np.float64)
        weight = steps / max(1.0, steps.sum())
        body, root, box = (outcomes.deviation[anywhere] * weight[:, None]).sum(0)
        hit, false, missed = outcomes.contact[anywhere].sum(0).tolist()
        boxed, some = hit + false + missed > 0, bool(anywhere.any())
        ends = outcomes.ends[anywhere].sum(axis=0) / max(1, int(anywhere.sum()))
        return {
            "trials": int(anywhere.sum()),
            "completed": proportion(outcomes.completed[anywhere]),
            "completed_whole": proportion(outcomes.completed[whole]),
            "body_cm": 100.0 * float(body) if some else None,
            "root_cm": 100.0 * float(root) if some else None,
            "object_cm": 100.0 * float(box) if boxed else None,
            "contact_f1": 2 * hit / (2 * hit + false + missed) if boxed else None,
            "ends": {name: float(share) for name, share in zip(ENDS, ends, strict=True)},
            "steps": float(steps.mean()) if some else None,
        }

    every = part(np.ones(len(clips), np.bool_))
    by_clip = [{"clip": str(name), **part(clips == name)} for name in sorted(set(clips.tolist()))]
    return every | {"by_clip": by_clip}


def table(figures: dict[str, Any]) -> Table:
    """The figures by clip, all of them first."""
    shown = Table(
        "clip (trials)", "completed %", "95 %", "whole %", "body cm", "root cm", "object cm",
        "contact F1", "ends: body, root, box, grip %",
        title=f"track: iteration {figures['iteration']}, {figures['wall_s']:.0f} s",
        title_justify="left",
    )  # fmt: skip
    rows: list[dict[str, Any]] = [{"clip": "all"} | figures, *figures["by_clip"]]
    for row in rows:
        low, high = row["completed"]["ci95"]
        shown.add_row(
            f"{row['clip']} ({row['trials']})",
            number(row["completed"]["rate"], 100) if row["trials"] else "-",
            f"{100 * low:.1f}-{100 * high:.1f}" if row["trials"] else "-",
            number(row["completed_whole"]["rate"], 100, 0),
            number(row["body_cm"]),
            number(row["root_cm"]),
            number(row["object_cm"]),
            number(row["contact_f1"], 1, 3),
            " ".join(f"{100 * share:.0f}" for share in row["ends"].values()),
        )
    return shown

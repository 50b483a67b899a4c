"""Teaches networks to carry from a script that sees the simulator's state, by DAgger (Ross et al.,
"A reduction of imitation learning and structured prediction to no-regret online learning", 2011).

Pupil and porter (world.teachers.carry) take turns at the servos, the pupil longer and longer; of
every state that they get into the porter says what it would do, and the pupil's networks are
regressed on all that it ever said. Lessons are given in processes of their own while this one
regresses, on a GPU where there is one. What came of it so far: docs/recipe.md, from "Taught by the porter" on;
`pretrained/carry` is of widths of 1024 and 512, from networks that had known 28.6 M rows: 11.5
minutes of 15 workers and batches of 8,192, then 107 of one worker and batches of 2,048.

python -m examples.teach_carry runs/taught --minutes 60 --workers 1
inhabit evaluate runs/taught
inhabit train carry --init runs/taught
"""

import copy
import json
import math
import queue
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
import torch.multiprocessing as mp
import tyro
from torch import Tensor

from console.run import assembly
from console.run.directory import checkpoint_folder
from console.run.experiment import Experiment, to_json
from examples.school import School, Settings
from learner.config import LearnerConfig
from learner.ppo import Learner
from policy.checkpoints.format import Manifest, read, write
from policy.model.acting import Policy
from policy.model.transfer import widened
from world.character import model as character
from world.config import WorldConfig
from world.tasks.carry import Carry

#: The regression's error is squared up to this, linear beyond.
_HUBER = 0.3
#: The pupil is the actor averaged over about so many batches.
_AVERAGED = 2000
#: Batches between two looks at the clock; seconds between two lines, and two checkpoints.
_CHUNK, _TELL_S, _SAVE_S = 50, 20.0, 60.0
_DATA = "none: a scripted teacher (world.teachers.carry)"


def weights_of(world: WorldConfig) -> Tensor:
    """[28]: what an action's error is worth: the torque that it makes, but none much more."""
    low, high = character.target_bounds()
    torque = torch.from_numpy(character.gains()[0] * world.action_scale * (high - low)).float()
    return (torque / torque.mean()).clamp(0.3, 3.0)


class Lessons:
    """What was seen and said, the newest `capacity` samples."""

    def __init__(self, capacity: int, observation: int, device: torch.device) -> None:
        self.seen = torch.empty(capacity, observation, device=device)
        self.said = torch.empty(capacity, character.NU, device=device)
        self.total = 0

    def add(self, seen: Tensor, said: Tensor) -> None:
        """Add samples [m, 150] and [m, 28]."""
        rows = (self.total + torch.arange(len(seen))) % len(self.seen)
        rows = rows.to(self.seen.device)
        self.seen[rows] = seen.to(self.seen.device)
        self.said[rows] = said.to(self.said.device)
        self.total += len(seen)

    def draw(self, n: int) -> tuple[Tensor, Tensor]:
        """Samples, half of them from the newest third."""
        device, m = self.seen.device, min(self.total, len(self.seen))
        age = torch.randint(0, m, (n,), device=device)
        age[::2] %= max(1, m // 3)
        rows = (self.total - 1 - age) % len(self.seen)
        return self.seen[rows], self.said[rows]


class Regression:
    """Of an actor on lessons; its average is the pupil."""

    def __init__(self, learner: Learner, worth: Tensor, settings: Settings) -> None:
        self.device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
        self.learner, self._settings = learner, settings
        self.actor = copy.deepcopy(learner.actor).to(self.device)
        self.average = copy.deepcopy(self.actor).requires_grad_(False)
        self._worth = worth.to(self.device)
        self._optimiser = torch.optim.Adam(self.actor.parameters(), settings.rate)
        self.steps = 0

    def begin(self, seen: Tensor, said: Tensor) -> None:
        """Where nothing is known yet, fit normaliser and linear map to samples [m, ..]."""
        if not self.learner.normaliser.count.any():
            self._fit(seen, said)
        normaliser = self.learner.normaliser
        self._mean = normaliser.mean.float().to(self.device)
        self._std = normaliser.std.to(self.device)

    @torch.no_grad()
    def _fit(self, seen: Tensor, said: Tensor) -> None:
        """The linear map by least squares."""
        self.learner.normaliser.update(seen.cpu())
        x = self.learner.normaliser(seen.cpu()).double()
        y = said.cpu().double()
        mean = y.mean(dim=0)
        ridge = x.T @ x + torch.eye(x.shape[1]).double()
        found = torch.linalg.solve(ridge, x.T @ (y - mean))
        for actor in (self.actor, self.average):
            assert actor.skip is not None
            actor.skip.weight.copy_(found.T)
            actor.head.bias.copy_(mean)

    def step(self, lessons: Lessons, rate: float) -> Tensor:
        """One batch; the mean squared error of its actions [], in their own units."""
        for group in self._optimiser.param_groups:
            group["lr"] = rate
        seen, said = lessons.draw(self._settings.batch)
        clip = self.learner.config.observation_clip
        error = self.actor(((seen - self._mean) / self._std).clamp_(-clip, clip)) - said
        loss = self._worth * torch.nn.functional.smooth_l1_loss(
            error, torch.zeros_like(error), beta=_HUBER, reduction="none"
        )
        self._optimiser.zero_grad(set_to_none=True)
        loss.mean().backward()
        self._optimiser.step()
        self.steps += 1
        with torch.no_grad():
            pairs = (list(net.parameters()) for net in (self.average, self.actor))
            torch._foreach_lerp_(*pairs, max(1.0 / _AVERAGED, 1.0 / self.steps))
        return error.detach().square().mean()

    def hand_back(self) -> Learner:
        """The learner with what was learned."""
        for mine, theirs in (
            (self.actor, self.learner.actor),
            (self.average, self.learner.average),
        ):
            theirs.load_state_dict(mine.state_dict())
        return self.learner


def experiment_of(settings: Settings) -> Experiment:
    """What the checkpoint says of itself."""
    world = WorldConfig(task="carry", episode_s=Carry.episode_s)
    ppo = LearnerConfig(hidden=settings.hidden, skip=True, observation_clip=10.0)
    return Experiment(seed=settings.seed, world=world, ppo=ppo)


def give(settings: Settings, number: int, said: Any, spell: Any, weights: Path) -> None:
    """A worker: lessons without end, by the newest pupil in the file `weights`."""
    torch.set_num_threads(1)
    mine = Settings(**{**vars(settings), "seed": settings.seed + 1000 * number})
    school, pupil, stamp = School(mine, experiment_of(settings).world), None, 0
    while True:
        if weights.exists() and weights.stat().st_mtime_ns != stamp:
            stamp = weights.stat().st_mtime_ns
            pupil = Policy(torch.load(weights))
        lesson = school.lesson(pupil, spell.value)
        said.put([part.numpy() for part in lesson])


def save(
    out: Path, experiment: Experiment, learner: Learner, samples: int, told: list[dict[str, float]]
) -> None:
    """Write the networks as a checkpoint, what was told so far beside them; the critic knows no
    more than it did before, which training sees to."""
    notes = {"experiment": json.dumps(to_json(experiment)), "data": _DATA}
    manifest = Manifest(assembly.layout(experiment), 0, samples, notes)
    write(out, {"policy": learner.policy_state()}, manifest)
    (out / "metrics.jsonl").write_text("".join(f"{json.dumps(line)}\n" for line in told))


def teach(settings: Settings) -> None:
    """Lessons and regression until the time is over; the networks are written every minute."""
    context = mp.get_context("spawn")
    said, spell = context.Queue(4 * settings.workers), context.Value("d", settings.spell[0])
    settings.out.parent.mkdir(parents=True, exist_ok=True)
    weights = settings.out.with_name(f".{settings.out.name}.pupil")
    weights.unlink(missing_ok=True)
    workers = [
        context.Process(target=give, args=(settings, k, said, spell, weights), daemon=True)
        for k in range(settings.workers)
    ]
    for worker in workers:
        worker.start()
    try:
        _regress(settings, said, spell, weights)
    finally:
        for worker in workers:
            worker.terminate()
            worker.join()
        weights.unlink(missing_ok=True)


def _regress(settings: Settings, said: Any, spell: Any, weights: Path) -> None:
    experiment = experiment_of(settings)
    learner = assembly.learner(experiment)
    if settings.init is not None:
        found = read(checkpoint_folder(settings.init), ("policy",))
        mine, theirs = assembly.layout(experiment), found.manifest.layout
        replace(mine, hidden=theirs.hidden).require(theirs, str(settings.init))
        policy = widened(found.state["policy"], settings.hidden, settings.seed, str(settings.init))
        learner.load_policy_state({**policy, "actor": policy["average"]})
        _publish(learner, weights)
    regression = Regression(learner, weights_of(experiment.world), settings)
    lessons = Lessons(settings.capacity, experiment_width(experiment), regression.device)
    while lessons.total < settings.first:
        _take(said, lessons, wait=True)
    regression.begin(lessons.seen[: lessons.total], lessons.said[: lessons.total])
    began = told = saved = time.monotonic()
    lines: list[dict[str, float]] = []
    errors, ended = [], []
    while (gone := (time.monotonic() - began) / (60.0 * settings.minutes)) < 1.0:
        ended += _take(said, lessons, wait=False)
        rate = 1e-6 + settings.rate * 0.5 * (1.0 + math.cos(math.pi * gone))
        errors += [regression.step(lessons, rate) for _ in range(_CHUNK)]
        first, last = settings.spell
        spell.value = first * (last / first) ** gone
        now = time.monotonic()
        if now - told > _TELL_S or now - began > 60.0 * settings.minutes:
            line = {
                "minutes": (now - began) / 60.0,
                "samples": lessons.total,
                "batches": regression.steps,
                "error": math.sqrt(float(torch.stack(errors).mean())),
                "spell": spell.value,
                **_report(ended),
            }
            lines.append(line)
            print(", ".join(f"{name} {value:.6g}" for name, value in line.items()), flush=True)
            errors, ended, told = [], [], now
            _publish(regression.hand_back(), weights)
        if now - saved > _SAVE_S:
            save(settings.out, experiment, regression.hand_back(), lessons.total, lines)
            saved = now
    save(settings.out, experiment, regression.hand_back(), lessons.total, lines)
    print(f"{settings.out}: {lessons.total} samples, {regression.steps} batches")
    learner.close()


def _publish(learner: Learner, weights: Path) -> None:
    """Give the pupil to the workers."""
    partial = weights.with_suffix(".part")
    torch.save(learner.averaged_weights(), partial)
    partial.replace(weights)


def _take(said: Any, lessons: Lessons, wait: bool) -> list[Tensor]:
    """Put waiting lessons to the others; how the episodes in them ended."""
    ended = []
    while True:
        try:
            seen, told, ends = (torch.from_numpy(part) for part in said.get(wait, 120.0))
        except queue.Empty:
            if wait:
                raise RuntimeError(
                    "no lesson came for two minutes: are the workers gone?"
                ) from None
            return ended
        lessons.add(seen, told)
        ended.append(ends)
        if wait:
            return ended


def _report(ended: list[Tensor]) -> dict[str, float]:
    """How episodes ended: those that the pupil had for itself, and the others."""
    names = ("steps", "fell", *Carry.stages)
    facts = torch.cat(ended) if ended else torch.zeros(0, 3 + len(Carry.stages))
    found: dict[str, float] = {}
    for who, some in (("alone", facts[facts[:, 0] > 0]), ("led", facts[facts[:, 0] == 0])):
        if len(some):
            found[f"{who}/episodes"] = len(some)
            means = zip(names, some[:, 1:].mean(dim=0).tolist(), strict=True)
            found |= {f"{who}/{name}": mean for name, mean in means}
    return found


def experiment_width(experiment: Experiment) -> int:
    """Of an observation."""
    return assembly.layout(experiment).observation


if __name__ == "__main__":
    torch.set_num_threads(1)
    teach(tyro.cli(Settings, description=__doc__))

"""Teaches networks to carry from a script that sees the simulator's state, by DAgger (Ross et al.,
"A reduction of imitation learning and structured prediction to no-regret online learning", 2011).

Pupil and porter (world.porter) take turns at the servoes, the pupil longer and longer; of every
state that they get into the porter says what it would do, and the pupil's networks are regressed on
all that it ever said. Lessons are given in processes of their own while this one regresses, on a
GPU where there is one. What came of it so far: docs/recipe.md, "Taught by the porter".

python examples/teach_carry.py runs/taught --minutes 60 --workers 1
inhabit evaluate runs/taught
inhabit train carry --init runs/taught
"""

import copy
import json
import math
import queue
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
import torch.multiprocessing as mp
import tyro
from torch import Tensor

from console import assembly
from console.experiment import Experiment, to_json
from console.runs import checkpoint_folder
from learner.config import LearnerConfig
from learner.ppo import Learner
from policy.acting import Policy
from policy.checkpoint import Manifest, read, write
from world import character, hands, rotations, tasks
from world.box_scene import box
from world.boxes import BoxBank, Layout
from world.config import WorldConfig
from world.features import STATE
from world.gait import unit
from world.porter import Porter
from world.scenes import Scenes
from world.tasks.carry import Carry

#: An episode ends after so many control steps, or so many with the box at its target; nobody who is
#: this low goes on, m.
_LONGEST, _HELD, _LYING_M = 600, 60, 0.45
#: What the porter says so many steps before a fall is not learned: it was too late for it.
_TOO_LATE = 25
#: The porter drives for about so many control steps before the pupil may again.
_SPELL = 20.0
#: The pupil has this share of the episodes for itself.
_ALONE = 0.1
#: The regression's error is squared up to this, linear beyond.
_HUBER = 0.3
#: The pupil is the actor averaged over about so many batches.
_AVERAGED = 2000
#: Batches between two looks at the clock; seconds between two lines, and two checkpoints.
_CHUNK, _TELL_S, _SAVE_S = 50, 20.0, 60.0
_DATA = "none: a scripted teacher (world.porter)"


@dataclass(frozen=True)
class Settings:
    """What is taught, and for how long."""

    out: tyro.conf.Positional[Path]
    """Folder to write the networks to, a checkpoint."""
    minutes: float = 60.0
    """How long."""
    workers: int = 1
    """Processes that give lessons."""
    steps: int = 40
    """Control steps of a lesson."""
    scenes: int = 128
    """Scenes of a lesson, each with a box of its own."""
    batch: int = 1024
    """Samples of a batch, half of them from the newest third."""
    rate: float = 1e-3
    """Learning rate of the first batch; it falls to nearly nothing by the last."""
    spell: tuple[float, float] = (10.0, 100.0)
    """Control steps that the pupil drives for before the porter takes over, at first and in the
    end: as many as it is likely to make without coming to where nobody can help it any more."""
    noise: float = 0.03
    """Of the actions in every other scene, in their own units."""
    in_hand: float = 0.25
    """Share of the episodes that start with the box in hand."""
    near: float = 0.25
    """Of the others, share that start within a step or two of the box."""
    init: Path | None = None
    """Checkpoint of a carry policy, with a linear map, to go on from."""
    walker: Path | None = None
    """Checkpoint of a carry policy that shall go on coming to the box as it does: the porter is the
    teacher from the last metres before the box on, and of who stands on the way."""
    first: int = 100_000
    """Samples before the first batch: normaliser and linear map are fitted to these."""
    capacity: int = 6_000_000
    """Samples kept, the newest."""
    hidden: tuple[int, ...] = (512, 256)
    """Widths of the networks."""
    seed: int = 0
    """Of everything that is random, but for who is first of several processes."""


class School:
    """The scenes of the lessons."""

    def __init__(self, settings: Settings, world: WorldConfig) -> None:
        n, (low, high) = settings.scenes, world.carry.scale
        self._settings, self._world = settings, world
        self._random = torch.Generator().manual_seed(settings.seed)
        self.bank = BoxBank([box(low + (high - low) * (i + 0.5) / n) for i in range(n)])
        self.scenes = Scenes(self.bank.models, world.action_scale, world.action_clip)
        self.task, self.porter, self.ids = Carry(), Porter(n), torch.arange(n)
        self._age, self._held = torch.zeros(n), torch.zeros(n)
        self._stages = torch.zeros(n, len(self.task.stages), dtype=torch.bool)
        self._drives = torch.zeros(n, dtype=torch.bool)
        self._alone = torch.zeros(n, dtype=torch.bool)
        walker = settings.walker
        self._walker = None if walker is None else Policy(assembly.trained(walker).weights)
        self._recent: list[tuple[Tensor, Tensor]] = []
        self._fell: list[Tensor] = []
        qpos, layout, laden = self._draw()
        self.place = self.bank.place(self.ids, layout)
        self._begin(self.ids, qpos, layout, laden)

    def lesson(self, pupil: Policy | None, spell: float) -> tuple[Tensor, Tensor, Tensor]:
        """Observations [m, 150] and what the porter would do then [m, 28] over a lesson in which
        the pupil drives for about so many control steps at a time; and of each episode that ended
        [k, 8] whether the pupil had it for itself, its length, whether it ended in a fall, and its
        stages."""
        seen, said, ended = [], [], []
        scale = self._settings.noise * (self.ids % 2 == 0)[:, None]
        for _ in range(self._settings.steps):
            now, body = self.scenes.now(self.place), self.scenes.body()
            state, goal = tasks.state(body, now), self.task.goal_features(body, now)
            qpos, qvel = self.scenes.qpos, self.scenes.qvel
            targets = self.porter.act(qpos, qvel, now, self.bank.mass)
            action = self.scenes.actions(targets).float()
            if self._walker is not None:
                comes = ~self.porter.teaches(now, body.root)[:, None]
                action = torch.where(comes, self._walker(state, goal), action)
            self._recent.append((torch.cat((state, goal), dim=1), action))
            if pupil is not None:
                changes = self._uniform() < torch.where(self._drives, 1.0 / spell, 1.0 / _SPELL)
                self._drives = (self._drives ^ changes) | self._alone
                action = torch.where(self._drives[:, None], pupil(state, goal), action)
            noise = torch.randn(action.shape, generator=self._random)
            self.scenes.act(torch.nan_to_num(action + scale * noise).double())
            fell, over = self._observe()
            self._fell.append(fell)
            if len(self._recent) > _TOO_LATE:
                one, other = self._recent.pop(0)
                late = torch.stack(self._fell).any(dim=0)
                self._fell.pop(0)
                kept = one.isfinite().all(dim=1) & other.isfinite().all(dim=1) & ~late
                seen.append(one[kept])
                said.append(other[kept])
            if over.any():
                facts = (self._alone, self._age, fell, *self._stages.T)
                ended.append(torch.stack([fact.float() for fact in facts], dim=1)[over])
                self.again(over)
                self._drives &= ~over
                alone = (self._uniform() < _ALONE) & (pupil is not None)
                self._alone = torch.where(over, alone, self._alone)
        none = torch.zeros(0, 3 + len(self.task.stages))
        width = STATE.width + self.task.goal.width
        return _rows(seen, width), _rows(said, character.NU), torch.cat([none, *ended])

    def drive(self) -> tuple[Tensor, Tensor]:
        """One control step by the porter alone; [n] bool each: who fell, whose episode is over."""
        now = self.scenes.now(self.place)
        self.scenes.drive(self.porter.act(self.scenes.qpos, self.scenes.qvel, now, self.bank.mass))
        return self._observe()

    def again(self, over: Tensor) -> None:
        """Begin anew where it is over [n] bool."""
        if over.any():
            self._begin(over.nonzero().flatten(), *self._draw())

    def _observe(self) -> tuple[Tensor, Tensor]:
        """[n] bool each: the character or the box fell; the episode is over."""
        now, body = self.scenes.now(self.place), self.scenes.body()
        fell = self.task.fell(body, now) | (body.root[:, 2] < _LYING_M) | ~self.scenes.finite()
        self._stages |= self.task.stage(body, now) & ~fell[:, None]
        there = self.task.error_m(body, now) < self.task.success_m
        self._held = torch.where(there, self._held + 1, 0.0)
        self._age += 1
        return fell, fell | (self._held > _HELD) | (self._age > _LONGEST)

    def _begin(self, rows: Tensor, qpos: Tensor, layout: Layout, laden: Tensor) -> None:
        """Start episodes in the scenes `rows` [m] as drawn for all [n]."""
        none = torch.zeros(len(rows), character.NV)
        at = layout.rows(rows)
        self.scenes.set_down(rows, qpos[rows], none, at.start, at.start_yaw)
        self.bank.put(self.scenes, rows, rows, at)
        self.place.write(rows, self.bank.place(rows, at))
        self.porter.reset(rows, laden[rows])
        self._age[rows], self._held[rows], self._stages[rows] = 0.0, 0.0, False

    def _draw(self) -> tuple[Tensor, Layout, Tensor]:
        """Starts of all scenes: standing characters [n, 43], and their boxes, on stands about them
        or [n] in hand."""
        half, n = self.bank.half, len(self.ids)
        qpos = torch.from_numpy(character.standing_qpos()).float()[None].repeat(n, 1)
        laden = self._uniform() < self._settings.in_hand
        ahead = torch.tensor([[1.0, 0.0]]).repeat(n, 1)
        near = self._uniform() < self._settings.near
        far = torch.where(near, self._between(0.6, 1.5), self._between(1.0, 5.0))
        far = torch.maximum(far, half[:, :2].norm(dim=1) + 0.35)
        on_stand = self._about(torch.zeros(n, 2), far)
        in_hand = hands.before(qpos[:, :3], ahead, half[:, 0])
        gone = torch.tensor([[-6.0, 0.0]]).repeat(n, 1)
        stand_m = half[:, 2] + self._between(*self._world.carry.stand_m)
        start = torch.where(laden[:, None], gone, on_stand)
        start = torch.cat((start, stand_m[:, None]), dim=1)
        position = torch.where(laden[:, None], in_hand, start)
        yaw = unit(2.0 * math.pi * self._uniform())
        yaw = torch.where(laden[:, None], ahead, yaw)
        from_box = self._about(on_stand, self._between(1.0, 5.0))
        # where one stands there is no room for a stand: then on the other side of the box
        crowded = (from_box.norm(dim=1) < 0.8)[:, None]
        from_box = torch.where(crowded, 2.0 * on_stand - from_box, from_box)
        from_self = self._about(torch.zeros(n, 2), self._between(0.6, 4.0))
        target = torch.where(laden[:, None], from_self, from_box)
        end_m = half[:, 2] + self._between(*self._world.carry.stand_m)
        target = torch.cat((target, end_m[:, None]), dim=1)
        rest = torch.zeros(n, 6)
        layout = Layout(position, rotations.from_heading(yaw), rest, start, yaw, target)
        state = self.bank.place(self.ids, layout).box
        assert state is not None
        return torch.where(laden[:, None], hands.holding(qpos, state), qpos), layout, laden

    def _about(self, point: Tensor, far: Tensor) -> Tensor:
        """[n, 2]: so far [n] from points [n, 2], anywhere round them."""
        return point + far[:, None] * unit(2.0 * math.pi * self._uniform())

    def _between(self, low: float, high: float) -> Tensor:
        return low + (high - low) * self._uniform()

    def _uniform(self) -> Tensor:
        return torch.rand(len(self.ids), generator=self._random)


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
        path = checkpoint_folder(settings.init)
        found = read(path, ("policy",), assembly.layout(experiment))
        policy = found.state["policy"]
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


def _rows(parts: list[Tensor], width: int) -> Tensor:
    return torch.cat([torch.zeros(0, width), *parts])


def experiment_width(experiment: Experiment) -> int:
    """Of an observation."""
    return assembly.layout(experiment).observation


if __name__ == "__main__":
    torch.set_num_threads(1)
    teach(tyro.cli(Settings, description=__doc__))

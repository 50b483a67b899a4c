"""Teaches networks to carry from a script that sees the simulator's state, by DAgger (Ross et al.,
"A reduction of imitation learning and structured prediction to no-regret online learning", 2011).

Pupil and porter (world.porter) take turns at the servoes, the porter less and less; of every state
that they get into the porter says what it would do, and the pupil's networks are regressed on all
that it ever said. What came of it so far: docs/recipe.md, "A script for the whole body".

python examples/teach_carry.py runs/taught
inhabit evaluate runs/taught
inhabit train carry --init runs/taught
"""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import torch
import tyro
from torch import Tensor

from console import assembly
from console.experiment import Experiment, to_json
from learner.config import LearnerConfig
from learner.ppo import Learner
from policy.checkpoint import Manifest, write
from world import character, hands, rotations, tasks
from world.box_scene import box
from world.boxes import BoxBank, Layout
from world.config import WorldConfig
from world.gait import unit
from world.porter import Porter
from world.scenes import Scenes
from world.tasks.carry import Carry

#: An episode ends after so many control steps, or so many with the box at its target; nobody who is
#: this low goes on, m.
_LONGEST, _HELD, _LYING_M = 600, 60, 0.45
#: What the porter says so many steps before a fall is not learned: it was too late for it.
_TOO_LATE = 14
#: Who drives changes so often a control step, where both may.
_CHANGES = 0.02
#: The regression's error is squared up to this, linear beyond.
_HUBER = 0.3
#: The pupil is the actor averaged over about so many batches.
_AVERAGED = 1000
_DATA = "none: a scripted teacher (world.porter)"

Pupil = Callable[[Tensor], Tensor]


@dataclass(frozen=True)
class Settings:
    """What is taught, and for how long."""

    out: tyro.conf.Positional[Path]
    """Folder to write the networks to, a checkpoint."""
    rounds: int = 30
    """Rounds of lessons, each followed by a regression on all so far."""
    steps: int = 400
    """Control steps of a round."""
    scenes: int = 128
    """Scenes at once, each with a box of its own."""
    batches: int = 1500
    """Batches of a regression."""
    batch: int = 1024
    """Samples of a batch, half of them from the newest third."""
    rate: float = 1e-3
    """Learning rate of the first batch; it falls to nearly nothing by the last."""
    alone: float = 0.8
    """The porter's share of the driving falls by this factor a round."""
    noise: float = 0.04
    """Of the actions in every other scene, in their own units."""
    in_hand: float = 0.25
    """Share of the episodes that start with the box in hand."""
    hidden: tuple[int, ...] = (512, 256)
    """Widths of the networks."""
    seed: int = 0
    """Of everything that is random."""


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
        qpos, layout, laden = self._draw()
        self.place = self.bank.place(self.ids, layout)
        self._begin(self.ids, qpos, layout, laden)

    def lesson(self, pupil: Pupil | None, share: float) -> tuple[Tensor, Tensor, str]:
        """Observations [m, 150] and what the porter would do then [m, 28] over a round in which it
        drives in this share of the time; and how the episodes that ended went."""
        seen, said, valid, ended = [], [], [], []
        scale = self._settings.noise * (self.ids % 2 == 0)[:, None]
        for _ in range(self._settings.steps):
            now, body = self.scenes.now(self.place), self.scenes.body()
            features = (tasks.state(body, now), self.task.goal_features(body, now))
            observation = torch.cat(features, dim=1)
            qpos, qvel = self.scenes.qpos, self.scenes.qvel
            targets = self.porter.act(qpos, qvel, now, self.bank.mass)
            action = self.scenes.actions(targets).float()
            valid.append(action.isfinite().all(dim=1) & observation.isfinite().all(dim=1))
            seen.append(observation)
            said.append(action)
            if pupil is not None:
                changes = self._uniform() < _CHANGES
                self._drives = torch.where(changes, self._uniform() >= share, self._drives)
                action = torch.where(self._drives[:, None], pupil(observation), action)
            noise = torch.randn(action.shape, generator=self._random)
            self.scenes.act(torch.nan_to_num(action + scale * noise).double())
            fell, over = self._observe()
            for late in valid[-_TOO_LATE:]:
                late[fell] = False
            if over.any():
                ended.append(torch.cat((fell[:, None], self._stages), dim=1)[over].float())
                rows = over.nonzero().flatten()
                self._begin(rows, *self._draw())
        kept = torch.cat(valid)
        return torch.cat(seen)[kept], torch.cat(said)[kept], self._report(ended)

    def _report(self, ended: list[Tensor]) -> str:
        if not ended:
            return "no episode ended"
        names, means = ("fell", *self.task.stages), torch.cat(ended).mean(dim=0).tolist()
        return ", ".join(f"{name} {mean:.2f}" for name, mean in zip(names, means, strict=True))

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
        far = torch.where(self._uniform() < 0.25, self._between(0.6, 1.5), self._between(1.0, 5.0))
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


def regress(learner: Learner, seen: Tensor, said: Tensor, worth: Tensor, s: Settings) -> float:
    """Regress the actor on what was said [m, 28] of what was seen [m, 150], and its average with
    it; the mean error of its actions, in their own units."""
    m, actor = len(seen), learner.actor
    optimiser = torch.optim.Adam(actor.parameters(), s.rate)
    random = torch.Generator().manual_seed(s.seed + m)
    newest = m - max(1, m // 3)
    total = 0.0
    for step in range(s.batches):
        for group in optimiser.param_groups:
            group["lr"] = s.rate * (1.0 - step / s.batches) + 1e-5
        rows = torch.randint(0, m, (s.batch,), generator=random)
        rows[::2] = torch.randint(newest, m, (len(rows[::2]),), generator=random)
        error = worth * (actor(learner.normaliser(seen[rows])) - said[rows])
        loss = torch.nn.functional.smooth_l1_loss(error, torch.zeros_like(error), beta=_HUBER)
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        optimiser.step()
        total += float((error / worth).detach().square().mean())
        with torch.no_grad():
            keep = 1.0 / min(_AVERAGED, step + 1)
            pairs = zip(learner.average.parameters(), actor.parameters(), strict=True)
            for mean, value in pairs:
                mean.lerp_(value, keep)
    return math.sqrt(total / s.batches)


def save(out: Path, experiment: Experiment, learner: Learner, samples: int) -> None:
    """Write the networks as a checkpoint; its critic knows nothing yet, which training sees to."""
    notes = {"experiment": json.dumps(to_json(experiment)), "data": _DATA}
    manifest = Manifest(assembly.layout(experiment), 0, samples, notes)
    write(out, {"policy": learner.policy_state()}, manifest)


def teach(settings: Settings) -> None:
    """All rounds; the networks are written after each."""
    world = WorldConfig(task="carry", episode_s=Carry.episode_s)
    ppo = LearnerConfig(hidden=settings.hidden, observation_clip=10.0)
    experiment = Experiment(seed=settings.seed, world=world, ppo=ppo)
    learner, worth = assembly.learner(experiment), weights_of(world)
    school = School(settings, world)

    @torch.no_grad()
    def pupil(observation: Tensor) -> Tensor:
        return learner.average(learner.normaliser(observation))

    seen, said = torch.zeros(0, learner.normaliser.mean.numel()), torch.zeros(0, character.NU)
    for k in range(settings.rounds):
        share = settings.alone**k
        new_seen, new_said, report = school.lesson(pupil if k else None, share)
        if k == 0:
            learner.normaliser.update(new_seen)
        seen, said = torch.cat((seen, new_seen)), torch.cat((said, new_said))
        error = regress(learner, seen, said, worth, settings)
        save(settings.out, experiment, learner, len(seen))
        print(f"round {k}: porter {share:.2f}, {len(seen)} samples, error {error:.3f}; {report}")
    learner.close()


if __name__ == "__main__":
    torch.set_num_threads(1)
    teach(tyro.cli(Settings, description=__doc__))

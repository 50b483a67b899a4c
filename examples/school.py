"""The scenes in which networks are taught to carry (examples/teach_carry.py): pupil and porter take
turns at the servos, and of every state the porter says what it would do."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import torch
import tyro
from torch import Tensor

from console.run import assembly
from policy.model.acting import Policy
from world import rotations, tasks
from world.character import model as character
from world.character.features import STATE
from world.config import WorldConfig
from world.objects import grasp
from world.objects.box_bank import BoxBank, Layout
from world.scene.batch import Scenes
from world.scene.box import box
from world.tasks.carry import Carry
from world.teachers.carry import Phase, Porter
from world.teachers.gait import unit

#: An episode ends after so many control steps, or so many with the box at its target; nobody who is
#: this low goes on, m.
_LONGEST, _HELD, _LYING_M = 600, 60, 0.45
#: What the porter says so many steps before a fall is not learned: it was too late for it.
_TOO_LATE = 25
#: The porter drives for about so many control steps before the pupil may again.
_SPELL = 20.0
#: The pupil has this share of the episodes for itself.
_ALONE = 0.1


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
    lifted: float = 0.0
    """Share that start where the box of their scene was lifted last, whoever had the servos."""
    skew: float = 1.0
    """Exponent of the boxes' sizes: uniform at 1, below that more of them are large."""
    init: Path | None = None
    """Checkpoint of a carry policy, with a linear map, to go on from; narrower networks grow."""
    walker: Path | None = None
    """Checkpoint of a carry policy that shall go on coming to the box as it does: the porter is the
    teacher from the last metres before the box on, and of who stands on the way. Its neck must
    tell its steps (world.teachers.phase_cue)."""
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
        sizes = [low + (high - low) * ((i + 0.5) / n) ** settings.skew for i in range(n)]
        self.bank = BoxBank([box(size) for size in sizes])
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
        self.place, self._layout = self.bank.target(self.ids, layout), layout
        self._liftings = _Liftings(qpos, torch.zeros(n, character.NV), layout, self.porter.memory())
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
            before = self.porter.phase
            targets = self.porter.act(qpos, qvel, now, self.bank.mass)
            self._keep((before == Phase.PICK_UP) & (self.porter.phase == Phase.CARRY))
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
            goes_on = over & self._liftings.known & (self._uniform() < self._settings.lifted)
            self._go_on(goes_on.nonzero().flatten())

    def _observe(self) -> tuple[Tensor, Tensor]:
        """[n] bool each: the character or the box fell; the episode is over."""
        now, body = self.scenes.now(self.place), self.scenes.body()
        fell = self.task.fell(body, now) | (body.root[:, 2] < _LYING_M) | ~self.scenes.finite()
        self._stages |= self.task.stage(body, now) & ~fell[:, None]
        there = self.task.error_m(body, now) < self.task.success_m
        self._held = torch.where(there, self._held + 1, 0.0)
        self._age += 1
        return fell, fell | (self._held > _HELD) | (self._age > _LONGEST)

    def _begin(
        self,
        rows: Tensor,
        qpos: Tensor,
        layout: Layout,
        laden: Tensor,
        qvel: Tensor | None = None,
    ) -> None:
        """Start episodes in the scenes `rows` [m] as told for all [n], at rest unless qvel [n, 34]
        says otherwise."""
        moves = torch.zeros(len(rows), character.NV) if qvel is None else qvel[rows]
        at = layout.rows(rows)
        self.scenes.set_down(rows, qpos[rows], moves, at.start, at.start_yaw)
        self.bank.put(self.scenes, rows, rows, at)
        self.place.write(rows, self.bank.target(rows, at))
        _write(self._layout, rows, at)
        self.porter.reset(rows, laden[rows])
        self._age[rows], self._held[rows], self._stages[rows] = 0.0, 0.0, False

    def _keep(self, lifts: Tensor) -> None:
        """Keep the states of the scenes whose boxes are lifted now [n] bool."""
        rows, scenes = lifts.nonzero().flatten(), self.scenes
        pose, velocity = scenes.free_qpos[rows, :7].float(), scenes.free_qvel[rows, :6].float()
        at = replace(
            self._layout.rows(rows),
            position=pose[:, :3],
            rotation=rotations.normalise(pose[:, 3:]),
            velocity=velocity,
        )
        body = scenes.qpos[rows].float(), scenes.qvel[rows].float()
        self._liftings.keep(rows, *body, at, self.porter.memory())

    def _go_on(self, rows: Tensor) -> None:
        """Start where the boxes of the scenes `rows` [m] were lifted last."""
        kept = self._liftings
        if len(rows):
            laden = torch.ones(len(self.ids), dtype=torch.bool)
            self._begin(rows, kept.qpos, kept.layout, laden, kept.qvel)
            for name, value in self.porter.memory().items():
                value[rows] = kept.memory[name][rows]

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
        in_hand = grasp.before(qpos[:, :3], ahead, half[:, 0])
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
        state = self.bank.target(self.ids, layout).box
        assert state is not None
        return torch.where(laden[:, None], grasp.holding(qpos, state), qpos), layout, laden

    def _about(self, point: Tensor, far: Tensor) -> Tensor:
        """[n, 2]: so far [n] from points [n, 2], anywhere round them."""
        return point + far[:, None] * unit(2.0 * math.pi * self._uniform())

    def _between(self, low: float, high: float) -> Tensor:
        return low + (high - low) * self._uniform()

    def _uniform(self) -> Tensor:
        return torch.rand(len(self.ids), generator=self._random)


class _Liftings:
    """Where in each of n scenes the box was lifted last, and what the porter remembered then."""

    def __init__(
        self, qpos: Tensor, qvel: Tensor, layout: Layout, memory: dict[str, Tensor]
    ) -> None:
        self.known = torch.zeros(len(qpos), dtype=torch.bool)
        """[n]: there is one."""
        self.qpos, self.qvel = qpos.clone(), qvel.clone()
        self.layout = Layout(**{name: part.clone() for name, part in vars(layout).items()})
        self.memory = {name: part.clone() for name, part in memory.items()}

    def keep(
        self, rows: Tensor, qpos: Tensor, qvel: Tensor, at: Layout, memory: dict[str, Tensor]
    ) -> None:
        """Of the scenes `rows` [m]: their states, and the memory of all."""
        self.known[rows], self.qpos[rows], self.qvel[rows] = True, qpos, qvel
        _write(self.layout, rows, at)
        for name, part in self.memory.items():
            part[rows] = memory[name][rows]


def _write(layout: Layout, rows: Tensor, part: Layout) -> None:
    """Overwrite the scenes `rows` [m] with those of `part` [m]."""
    for name, value in vars(part).items():
        getattr(layout, name)[rows] = value


def _rows(parts: list[Tensor], width: int) -> Tensor:
    return torch.cat([torch.zeros(0, width), *parts])

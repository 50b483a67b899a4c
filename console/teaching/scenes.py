"""The scenes of DAgger: student and scripted teacher drive in turn, the teacher labels every
state."""

import math
from dataclasses import replace

import torch
from torch import Tensor

from console.commands.teaching import Practice
from console.run import assembly
from console.teaching.lifted import LiftedStates, overwrite
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
from world.teachers.scripted.controller import CarryController, Phase
from world.teachers.scripted.gait import unit

#: Greatest number of control steps of an episode, of those with the box at its target, and lowest
#: root height, m; each ends an episode.
_LONGEST, _HELD, _LYING_M = 600, 60, 0.45
#: Control steps before a fall whose labels are dropped, as no action can prevent the fall then.
_BEFORE_FALL = 25
#: Mean number of control steps that the teacher drives at a time.
_SPELL = 20.0
#: Fraction of the episodes that the student drives alone.
_ALONE = 0.1


class TeachingScenes:
    """Scenes of the carry task with a scripted teacher each."""

    def __init__(self, practice: Practice, world: WorldConfig) -> None:
        n, (low, high) = practice.scenes, world.carry.scale
        self._practice, self._world = practice, world
        self._random = torch.Generator().manual_seed(practice.seed)
        sizes = [low + (high - low) * ((i + 0.5) / n) ** practice.skew for i in range(n)]
        self.bank = BoxBank([box(size) for size in sizes])
        self.scenes = Scenes(self.bank.models, world.action_scale, world.action_clip)
        self.task, self.controller, self.ids = Carry(), CarryController(n), torch.arange(n)
        self._age, self._held = torch.zeros(n), torch.zeros(n)
        self._stages = torch.zeros(n, len(self.task.stages), dtype=torch.bool)
        self._drives = torch.zeros(n, dtype=torch.bool)
        self._alone = torch.zeros(n, dtype=torch.bool)
        walker = practice.walker
        self._walker = None if walker is None else Policy(assembly.trained(walker).weights)
        self._recent: list[tuple[Tensor, Tensor]] = []
        self._fell: list[Tensor] = []
        qpos, layout, carrying = self._draw()
        self.target, self._layout = self.bank.target(self.ids, layout), layout
        still = torch.zeros(n, character.NV)
        self._lifted = LiftedStates(qpos, still, layout, self.controller.state_dict())
        self._begin(self.ids, qpos, layout, carrying)

    def collect(self, student: Policy | None, spell: float) -> tuple[Tensor, Tensor, Tensor]:
        """Return observations [m, 150] and teacher actions [m, 28] of the next control steps, in
        which the student drives for about `spell` steps at a time; and for each ended episode [k,
        8] whether the student drove it alone, its length, whether it ended in a fall, its stages.
        """
        observations, labels, ended = [], [], []
        scale = self._practice.noise * (self.ids % 2 == 0)[:, None]
        for _ in range(self._practice.steps):
            now, body = self.scenes.now(self.target), self.scenes.body()
            state, goal = tasks.state(body, now), self.task.goal_features(body, now)
            qpos, qvel = self.scenes.qpos, self.scenes.qvel
            before = self.controller.phase
            targets = self.controller.set_points(qpos, qvel, now, self.bank.mass)
            self._keep((before == Phase.PICK_UP) & (self.controller.phase == Phase.CARRY))
            action = self.scenes.actions(targets).float()
            if self._walker is not None:
                approaches = ~self.controller.is_useful(now, body.root)[:, None]
                action = torch.where(approaches, self._walker(state, goal), action)
            self._recent.append((torch.cat((state, goal), dim=1), action))
            if student is not None:
                changes = self._uniform() < torch.where(self._drives, 1.0 / spell, 1.0 / _SPELL)
                self._drives = (self._drives ^ changes) | self._alone
                action = torch.where(self._drives[:, None], student(state, goal), action)
            noise = torch.randn(action.shape, generator=self._random)
            self.scenes.act(torch.nan_to_num(action + scale * noise).double())
            fell, over = self._observe()
            self._fell.append(fell)
            if len(self._recent) > _BEFORE_FALL:
                observation, label = self._recent.pop(0)
                falls = torch.stack(self._fell).any(dim=0)
                self._fell.pop(0)
                kept = observation.isfinite().all(dim=1) & label.isfinite().all(dim=1) & ~falls
                observations.append(observation[kept])
                labels.append(label[kept])
            if over.any():
                facts = (self._alone, self._age, fell, *self._stages.T)
                ended.append(torch.stack([fact.float() for fact in facts], dim=1)[over])
                self.restart(over)
                self._drives &= ~over
                alone = (self._uniform() < _ALONE) & (student is not None)
                self._alone = torch.where(over, alone, self._alone)
        none = torch.zeros(0, 3 + len(self.task.stages))
        width = STATE.width + self.task.goal.width
        joined = _joined(observations, width), _joined(labels, character.NU)
        return *joined, torch.cat([none, *ended])

    def drive(self) -> tuple[Tensor, Tensor]:
        """Step by the teacher's set-points; return [n] bool each: fell, the episode is over."""
        now, scenes = self.scenes.now(self.target), self.scenes
        scenes.drive(self.controller.set_points(scenes.qpos, scenes.qvel, now, self.bank.mass))
        return self._observe()

    def restart(self, over: Tensor) -> None:
        """Start new episodes where the last one is over [n] bool."""
        if over.any():
            self._begin(over.nonzero().flatten(), *self._draw())
            from_lift = over & self._lifted.exists & (self._uniform() < self._practice.lifted)
            self._begin_lifted(from_lift.nonzero().flatten())

    def _observe(self) -> tuple[Tensor, Tensor]:
        """Return [n] bool each: character or box fell; the episode is over."""
        now, body = self.scenes.now(self.target), self.scenes.body()
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
        carrying: Tensor,
        qvel: Tensor | None = None,
    ) -> None:
        """Start episodes in the scenes `rows` [m] from states of all n; at rest without qvel
        [n, 34]."""
        moves = torch.zeros(len(rows), character.NV) if qvel is None else qvel[rows]
        at = layout.rows(rows)
        self.scenes.set_state(rows, qpos[rows], moves, at.start, at.start_yaw)
        self.bank.apply(self.scenes, rows, rows, at)
        self.target.write(rows, self.bank.target(rows, at))
        overwrite(self._layout, rows, at)
        self.controller.reset(rows, carrying[rows])
        self._age[rows], self._held[rows], self._stages[rows] = 0.0, 0.0, False

    def _keep(self, lifts: Tensor) -> None:
        """Store the states of the scenes whose boxes have just been lifted [n] bool."""
        rows, scenes = lifts.nonzero().flatten(), self.scenes
        pose, velocity = scenes.free_qpos[rows, :7].float(), scenes.free_qvel[rows, :6].float()
        at = replace(
            self._layout.rows(rows),
            position=pose[:, :3],
            rotation=rotations.normalise(pose[:, 3:]),
            velocity=velocity,
        )
        body = scenes.qpos[rows].float(), scenes.qvel[rows].float()
        self._lifted.keep(rows, *body, at, self.controller.state_dict())

    def _begin_lifted(self, rows: Tensor) -> None:
        """Start the scenes `rows` [m] from the states in which their boxes were last lifted."""
        kept = self._lifted
        if len(rows):
            carrying = torch.ones(len(self.ids), dtype=torch.bool)
            self._begin(rows, kept.qpos, kept.layout, carrying, kept.qvel)
            for name, value in self.controller.state_dict().items():
                value[rows] = kept.teacher[name][rows]

    def _draw(self) -> tuple[Tensor, Layout, Tensor]:
        """Draw initial states of all scenes: standing characters [n, 43], layouts with boxes on
        stands or in hand, and which are in hand [n] bool."""
        half, n = self.bank.half, len(self.ids)
        qpos = torch.from_numpy(character.standing_qpos()).float()[None].repeat(n, 1)
        carrying = self._uniform() < self._practice.in_hand
        ahead = torch.tensor([[1.0, 0.0]]).repeat(n, 1)
        near = self._uniform() < self._practice.near
        far = torch.where(near, self._between(0.6, 1.5), self._between(1.0, 5.0))
        far = torch.maximum(far, half[:, :2].norm(dim=1) + 0.35)
        on_stand = self._about(torch.zeros(n, 2), far)
        in_hand = grasp.held_centre(qpos[:, :3], ahead, half[:, 0])
        gone = torch.tensor([[-6.0, 0.0]]).repeat(n, 1)
        stand_m = half[:, 2] + self._between(*self._world.carry.stand_m)
        start = torch.where(carrying[:, None], gone, on_stand)
        start = torch.cat((start, stand_m[:, None]), dim=1)
        position = torch.where(carrying[:, None], in_hand, start)
        yaw = unit(2.0 * math.pi * self._uniform())
        yaw = torch.where(carrying[:, None], ahead, yaw)
        from_box = self._about(on_stand, self._between(1.0, 5.0))
        # a stand would overlap the character: the target is then on the other side of the box
        crowded = (from_box.norm(dim=1) < 0.8)[:, None]
        from_box = torch.where(crowded, 2.0 * on_stand - from_box, from_box)
        from_self = self._about(torch.zeros(n, 2), self._between(0.6, 4.0))
        target = torch.where(carrying[:, None], from_self, from_box)
        end_m = half[:, 2] + self._between(*self._world.carry.stand_m)
        target = torch.cat((target, end_m[:, None]), dim=1)
        rest = torch.zeros(n, 6)
        layout = Layout(position, rotations.from_heading(yaw), rest, start, yaw, target)
        state = self.bank.target(self.ids, layout).box
        assert state is not None
        return (
            torch.where(carrying[:, None], grasp.holding_pose(qpos, state), qpos),
            layout,
            carrying,
        )

    def _about(self, point: Tensor, far: Tensor) -> Tensor:
        """Draw points [n, 2] at distances [n] from points [n, 2], in uniform directions."""
        return point + far[:, None] * unit(2.0 * math.pi * self._uniform())

    def _between(self, low: float, high: float) -> Tensor:
        return low + (high - low) * self._uniform()

    def _uniform(self) -> Tensor:
        return torch.rand(len(self.ids), generator=self._random)


def _joined(parts: list[Tensor], width: int) -> Tensor:
    return torch.cat([torch.zeros(0, width), *parts])

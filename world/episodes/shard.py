"""The shard: a range of scenes that step together, with their episodes, rewards and resets.

All of it is torch over index sets; the only loops run over the few scenes whose object changes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from world import random_streams, tasks
from world.character import features
from world.character import model as character
from world.character.features import Body
from world.config import WorldConfig
from world.device import CPU, moved, put
from world.episodes import disturbances, state_keys
from world.episodes.disturbances import Disturbances
from world.episodes.penalties import Penalties
from world.episodes.stall import StallTimeout
from world.errors import ConfigError
from world.initial.sampler import AdaptiveSampler
from world.motions.library import MotionLibrary
from world.objects.bank import ObjectBank
from world.scene import simulators
from world.scene.target import Target
from world.scene.warp_config import DEFAULT, WarpConfig
from world.tasks import HELD, reward
from world.tasks.task import Task, statistic
from world.teachers.teacher import UNTAUGHT, Teacher


@dataclass(frozen=True)
class Step:
    """Results of one control step; see Rollout for their use."""

    reward: Tensor
    """[n]: weighted sum of the terms."""
    terms: Tensor
    """[n, n_terms]: the unweighted reward terms, of the task and penalties of motion
    (world.tasks.reward)."""
    fell: Tensor
    """[n] bool: terminal state: the character or its box fell, or the stall time-out expired."""
    timed_out: Tensor
    """[n] bool: the episode is truncated, by its time limit, by success held or by the end of the
    reference motion."""
    finite: Tensor
    """[n] bool: False where the simulation became non-finite; the sample is invalid."""
    end_ids: Tensor
    """[K] int64: scenes whose episode ended in this step, ascending."""
    end_states: Tensor
    """[K, 114]: last states of these."""
    end_goals: Tensor
    """[K, G]: last goals of these."""
    episodes: dict[str, Tensor]
    """[K] float32 each: return, length (control steps), success, fall, stalled (the stall time-out
    expired), start (category of the initial state, index into KINDS), for each stage of the task
    stage_NAME: whether the episode reached it, and the records of its target."""
    broken: Tensor
    """[B, 43 + 34] float64: qpos and qvel, before the step, of the scenes that became
    non-finite."""
    teacher_action: Tensor | None = None
    """[n, 28]: the teacher's action in the state before the step, NaN where it labels nothing;
    none: no teacher."""


class Shard:
    """The scenes with the global ids `scenes`, of one task."""

    def __init__(
        self,
        config: WorldConfig,
        library: MotionLibrary,
        bank: ObjectBank,
        scenes: Sequence[int],
        seed: int,
        teacher: Teacher | None = None,
        simulator: str = "mujoco",
        device: torch.device = CPU,
        warp: WarpConfig = DEFAULT,
        shown: Sequence[Task] = (),
    ) -> None:
        """device: where everything is computed and kept, the simulator's arrays too.

        shown: tasks whose goals are observed, one after the other; by default the task's own.
        """
        self.config = config
        self.device = device
        library, bank = moved(library, device), moved(bank, device)
        self.task = tasks.make(config.task)
        self._shown = tuple(shown) or (self.task,)
        self.n = len(scenes)
        self.clock = 0
        self._seed = seed
        self._ids = torch.tensor(scenes, dtype=torch.int64, device=device)
        self._all = torch.arange(self.n, device=device)
        self._bank = bank
        self._sampler = moved(self.task.affordance.sampler(config, library, bank, seed), device)
        self._scenes = simulators.make(
            simulator, bank, self.n, config.action_scale, config.action_clip, device, warp
        )
        weights = reward.weights(self.task, config.penalty)
        self._weights = put(torch.tensor(list(weights.values())), device)
        self._length = round((config.episode_s or self.task.episode_s) * character.CONTROL_HZ)
        self._hold = round(config.hold_s * character.CONTROL_HZ)
        self._episode = torch.zeros_like(self._all)
        self._steps = torch.zeros_like(self._all)
        self._apart = torch.zeros_like(self._all)
        self._held = torch.zeros_like(self._all)
        self._return = torch.zeros(self.n, device=device)
        self._kind = torch.zeros_like(self._all)
        self._variant = torch.zeros_like(self._all)
        stages = len(self.task.stages) + 1
        self._stages = torch.zeros(self.n, stages, dtype=torch.bool, device=device)
        self._state = torch.zeros(self.n, features.STATE.width, device=device)
        width = sum(task.goal.width for task in self._shown)
        self._goal = torch.zeros(self.n, width, device=device)
        self._targets: Target | None = None
        if teacher is not None and simulator != "mujoco":
            raise ConfigError(f"--simulator {simulator}: teachers need --simulator mujoco")
        self._teacher = teacher
        self._labelled: Tensor | None = None
        self._asks = True
        self._stall = StallTimeout(self.n, config.stall_s, device)
        penalised = reward.penalties(config.penalty)
        self._penalties = Penalties(self.n, config.penalty, device) if penalised else None
        disturbances.check(config, simulator)
        self._disturbances = (
            Disturbances(config.perturb, self._scenes, bank, self._ids, seed)
            if disturbances.active(config.perturb)
            else None
        )
        self._reset(self._all)
        # step counters are spread, so that not all scenes time out in the same step
        apart = random_streams.uniform(seed, random_streams.EPISODE, self._ids, 0, 16)[:, 15]
        self._steps[:] = (apart * self._length).long()
        self._apart = self._steps.clone()

    def observe(self) -> tuple[Tensor, Tensor]:
        """The current states [n, 114] and goals [n, G]; overwritten by the next step."""
        return self._state, self._goal

    def label(self) -> Tensor | None:
        """The teacher's actions [n, 28] in the present states, NaN where it has none; none: no
        teacher, or one that is not asked any more. The next step returns the same: a teacher is
        asked once in a control step."""
        if self._teacher is not None and self._asks and self._labelled is None:
            self._labelled = self._teacher.label(
                self._scenes, self._target(), self._variant, self.clock
            )
        return self._labelled

    def update_sampling(self, published: Mapping[str, Tensor]) -> None:
        """Adapt the sampling of initial states to what the learner publishes; see
        AdaptiveSampler. Its UNTAUGHT says that no label counts any more."""
        self._asks = UNTAUGHT not in published
        if isinstance(self._sampler, AdaptiveSampler):
            self._sampler.update_sampling(published)

    def step(self, action: Tensor) -> Step:
        """One control step with actions [n, 28]; scenes whose episode ends are reset at once."""
        before = torch.cat((self._scenes.qpos, self._scenes.qvel), dim=1)
        teacher_action = self.label()
        self._labelled = None
        if self._disturbances is not None:
            self._disturbances.push(self.clock)
        self._scenes.drive(self._scenes.set_points(action, self._target().set_points()))
        self.clock += 1
        finite = self._scenes.finite()
        body = self._scenes.body()
        target = self._target()
        target.advance(body)
        terms = self.task.reward_terms(body, target)
        if self._penalties is not None:
            terms = torch.cat((terms, self._penalties.after(body)), dim=1)
        # a fixed order of additions: the rounding of a matrix product depends on its number of rows
        earned = (terms * self._weights).sum(dim=1)
        error = self.task.error_m(body, target)
        # a low pelvis away from the object ends the episode: saves a third of early samples
        collapsed = ~self.task.low(body, target) & (body.root[:, 2] < self.config.early_pelvis_m)
        fell = self.task.fell(body, target) | collapsed
        stalled = self._stall.ends(body, target, error <= self.task.success_m) & ~fell
        fell = fell | stalled
        self._steps += 1
        self._held = torch.where(error <= self.task.success_m, self._held + 1, 0)
        completed = target.completed()
        held = self._held >= self._hold if completed is None else completed
        self._stages |= torch.cat((self.task.stage(body, target), held[:, None]), dim=1)
        timed_out = ((self._steps >= self._length) | held) & ~fell & finite
        fell = fell & finite
        earned = torch.where(finite, earned, 0.0)
        terms = torch.where(finite[:, None], terms, 0.0)
        self._return += earned
        if self._disturbances is not None:
            target = self._disturbed(self._disturbances, body, target)
        self._write_observations(body, target, None)

        ends = torch.nonzero(fell | timed_out).flatten()
        broken = torch.nonzero(~finite).flatten()
        step = Step(
            reward=earned,
            terms=terms,
            fell=fell,
            timed_out=timed_out,
            finite=finite,
            end_ids=ends,
            end_states=self._state[ends],
            end_goals=self._goal[ends],
            episodes={
                "return": self._return[ends],
                "length": (self._steps - self._apart)[ends].float(),
                "success": ((error <= self.task.success_m) & ~fell)[ends].float(),
                "fall": (fell & ~stalled)[ends].float(),
                "stalled": stalled[ends].float(),
                "start": self._kind[ends].float(),
                **{
                    statistic(name): self._stages[ends, k].float()
                    for k, name in enumerate((*self.task.stages, HELD))
                },
                **{k: value[ends].float() for k, value in target.episode_records().items()},
                **self._sampled(ends),
            },
            broken=before[broken],
            teacher_action=teacher_action,
        )
        again = torch.cat((ends, broken))
        if len(again):
            self._reset(again)
        return step

    def _sampled(self, ends: Tensor) -> dict[str, Tensor]:
        """What the ended episodes tell the learner for the sampler."""
        if not isinstance(self._sampler, AdaptiveSampler):
            return {}
        return self._sampler.episode_records(self._variant[ends], self._kind[ends])

    def _disturbed(self, what: Disturbances, body: Body, target: Target) -> Target:
        """Present targets after balls are thrown and objects moved."""
        assert self._targets is not None
        moved = what.after(self.clock, body, target, self._targets, self._variant)
        return self._target() if moved else target

    def _target(self) -> Target:
        """Present targets of all scenes."""
        assert self._targets is not None
        return self._scenes.now(self._targets)

    def _write_observations(self, body: Body, target: Target, ids: Tensor | None) -> None:
        """Store states and goals of all scenes, or of `ids`."""
        state = tasks.state(body, target)
        goals = [task.goal_features(body, target) for task in self._shown]
        goal = goals[0] if len(goals) == 1 else torch.cat(goals, dim=1)
        if ids is None:
            self._state, self._goal = state, goal
        else:
            self._state[ids], self._goal[ids] = state, goal

    def _reset(self, ids: Tensor) -> None:
        """Start the next episode in the scenes `ids` [K] (local)."""
        self._episode[ids] += 1
        padding = -len(ids) % disturbances.LANES
        rows = torch.cat((ids, ids[:1].expand(padding)))
        states = self._sampler.draw(self._ids[rows], self._episode[rows])
        self._scenes.choose(ids, self._bank, states.variant[: len(ids)])
        self._sampler.apply(self._scenes, rows, states)
        target = self._sampler.target(states)
        if self._targets is None:
            self._targets = target.rows(ids)
        self._targets.write(rows, target)
        self._variant[rows] = states.variant
        self._kind[rows] = states.kind
        self._steps[ids] = 0
        self._apart[ids] = 0
        self._held[ids] = 0
        self._return[ids] = 0.0
        self._stages[ids] = False
        now, body = self._scenes.now(self._targets.rows(rows), rows), self._scenes.body(rows)
        self._write_observations(body, now, rows)
        self._stall.reset(rows, body, now)
        if self._penalties is not None:
            self._penalties.reset(rows, body)
        if self._disturbances is not None:
            self._disturbances.reset(rows, self._episode[rows], states, body)
        if self._teacher is not None:
            self._teacher.reset(rows, now)

    def state_dict(self) -> dict[str, Tensor]:
        """All that an exact continuation needs, by name."""
        own = {
            name: getattr(self, f"_{name}").clone() for name in (*_EPISODE_FIELDS, "state", "goal")
        }
        assert self._targets is not None
        own |= {name: value.clone() for name, value in self._targets.tensors().items()}
        own |= {f"stall_{k}": v.clone() for k, v in self._stall.state_dict().items()}
        if self._penalties is not None:
            own |= {f"penalty_{k}": v.clone() for k, v in self._penalties.state_dict().items()}
        if self._disturbances is not None:
            disturbed = self._disturbances.state_dict()
            own |= {f"disturbance_{k}": v.clone() for k, v in disturbed.items()}
        physics = {f"physics_{k}": v for k, v in self._scenes.physics().items()}
        if self._teacher is not None:
            own |= {f"teacher_{k}": v.clone() for k, v in self._teacher.state_dict().items()}
        return own | physics | {"clock": torch.tensor(self.clock)}

    def load_state_dict(self, state: dict[str, Tensor]) -> None:
        """Restore what `state_dict` gave; the continuation is bit for bit the same."""
        state = state_keys.current(state)
        for name in (*_EPISODE_FIELDS, "state", "goal"):
            # older checkpoints lack these
            if name in state or name not in ("stages", "apart"):
                setattr(self, f"_{name}", state[name].to(self.device, copy=True))
        assert self._targets is not None
        for name, value in self._targets.tensors().items():
            if name in state or name != "head":
                value.copy_(state[name])
        # and these where they are older than the stall time-out
        if "stall_still" in state:
            self._stall.load_state_dict(state_keys.part(state, "stall_"))
        if self._penalties is not None:
            self._penalties.load_state_dict(state_keys.part(state, "penalty_"))
        if self._teacher is not None:
            self._teacher.load_state_dict(state_keys.part(state, "teacher_"))
        if self._disturbances is not None:
            self._disturbances.load_state_dict(state_keys.part(state, "disturbance_"))
        self._labelled = None
        self.clock = int(state["clock"])
        self._scenes.choose(self._all, self._bank, self._variant)
        self._scenes.load_physics(state_keys.part(state, "physics_"))


_EPISODE_FIELDS = ("episode", "steps", "held", "return", "kind", "variant", "stages", "apart")

"""A rollout worker: steps one shard with published weights, independent of its fleet."""

import time
from collections.abc import Callable, Mapping
from typing import Protocol

import torch
from torch import Tensor

from policy.model.acting import Policy
from policy.model.networks import log_density
from policy.rollout import Abandoned, Rollout
from world.device import CPU
from world.precision import decide
from world.random_streams import normal

#: Prefix of tensors for the shards among the published weights.
WORLD = "world."


class StepLike(Protocol):
    """Result of one step of a shard; read only."""

    @property
    def reward(self) -> Tensor:
        """[n]: task reward."""
        ...

    @property
    def fell(self) -> Tensor:
        """[n] bool: the episode ended in a terminal state."""
        ...

    @property
    def timed_out(self) -> Tensor:
        """[n] bool: the episode was truncated."""
        ...

    @property
    def finite(self) -> Tensor:
        """[n] bool: False where the sample is dropped."""
        ...

    @property
    def end_ids(self) -> Tensor:
        """[K] int64: scenes of the shard whose episode ended."""
        ...

    @property
    def end_states(self) -> Tensor:
        """[K, S]: the last states of these episodes."""
        ...

    @property
    def end_goals(self) -> Tensor:
        """[K, G]: the last goals of these episodes."""
        ...

    @property
    def terms(self) -> Tensor:
        """[n, terms]: unweighted reward terms."""
        ...

    @property
    def episodes(self) -> Mapping[str, Tensor]:
        """[K] by name: statistics of the ended episodes."""
        ...

    @property
    def teacher_action(self) -> Tensor | None:
        """[n, 28]: the teacher's actions, NaN where it labels nothing; None without a teacher."""
        ...


class ShardLike(Protocol):
    """Scenes stepped together; `world.episodes.shard.Shard` is one."""

    @property
    def clock(self) -> int:
        """Steps since the shard was made."""
        ...

    def observe(self) -> tuple[Tensor, Tensor]:
        """State [n, S] and goal [n, G]."""
        ...

    def update_sampling(self, published: Mapping[str, Tensor]) -> None:
        """Adapt the sampling of initial states to what the learner publishes, by name."""
        ...

    def step(self, action: Tensor) -> StepLike:
        """Apply actions [n, 28] for one control step."""
        ...

    def state_dict(self) -> dict[str, Tensor]:
        """Everything that an exact restart needs."""
        ...

    def load_state_dict(self, state: dict[str, Tensor]) -> None:
        """Restore a state."""
        ...


class Worker:
    """Rollouts of one shard.

    Inference runs on fixed blocks of scenes, and noise is a function of (seed, scene, clock): the
    numbers do not depend on how the scenes are divided over workers.
    """

    def __init__(
        self,
        shard: ShardLike,
        scenes: range,
        seed: int,
        block: int = 64,
        device: torch.device = CPU,
        abandoned: Callable[[], bool] = lambda: False,
    ) -> None:
        """device: where the shard's tensors are.

        abandoned: whether to end a rollout before its next control step.
        """
        self.device = device
        self._abandoned = abandoned
        self._before: dict[str, Tensor] | None = None
        """State of the shard at the beginning of the last rollout"""
        self.shard = shard
        self.scenes = scenes
        self.seed = seed
        self.block = block
        self._ids = torch.arange(scenes.start, scenes.stop, device=device)
        self._policy: Policy | None = None

    def rollout(
        self, weights: Mapping[str, Tensor], version: int, horizon: int, sigma: float
    ) -> Rollout:
        """Rollout of `horizon` steps of this shard's scenes with these weights.

        Raises Abandoned, between two steps, once it is abandoned; then only `rewind` makes sense.
        """
        self._before = self.shard.state_dict()
        if self._policy is None:
            self._policy = Policy(weights, decide(self.device.type), self.device)
        else:
            self._policy.load(weights)
        published = {k.removeprefix(WORLD): v for k, v in weights.items() if k.startswith(WORLD)}
        if published:
            self.shard.update_sampling(published)
        states, goals, actions, means, log_probs = [], [], [], [], []
        steps: list[StepLike] = []
        acting_s = world_s = 0.0
        began = time.perf_counter()
        state, goal = (x.clone() for x in self.shard.observe())
        world_s += time.perf_counter() - began
        for _ in range(horizon):
            if self._abandoned():
                raise Abandoned
            began = time.perf_counter()
            states.append(state)
            goals.append(goal)
            mean, action, log_prob = self._act(self._policy, state, goal, sigma)
            means.append(mean)
            actions.append(action)
            log_probs.append(log_prob)
            acted = time.perf_counter()
            steps.append(self.shard.step(action))
            # The shard may return views of its own arrays, which the next step overwrites.
            state, goal = (x.clone() for x in self.shard.observe())
            world_s += time.perf_counter() - acted
            acting_s += acted - began
        states.append(state)
        goals.append(goal)
        valid = torch.stack([s.finite for s in steps])
        terms = torch.stack([s.terms for s in steps]).double()
        index = [
            torch.stack((torch.full_like(s.end_ids, t), s.end_ids), -1) for t, s in enumerate(steps)
        ]
        return _in_order(
            Rollout(
                states=torch.stack(states),
                goals=torch.stack(goals),
                actions=torch.stack(actions),
                means=torch.stack(means),
                log_probs=torch.stack(log_probs),
                rewards=torch.stack([s.reward for s in steps]),
                term_sums=torch.where(valid[..., None], terms, 0.0).sum(0),
                fell=torch.stack([s.fell for s in steps]),
                timed_out=torch.stack([s.timed_out for s in steps]),
                valid=valid,
                end_index=torch.cat(index),
                end_states=torch.cat([s.end_states for s in steps]),
                end_goals=torch.cat([s.end_goals for s in steps]),
                episodes={
                    key: torch.cat([_finite_episodes(s, s.episodes[key]) for s in steps])
                    for key in steps[0].episodes
                },
                version=version,
                first_scene=self.scenes.start,
                seconds={"world": world_s, "policy": acting_s},
                teacher_action=_stacked([s.teacher_action for s in steps]),
            )
        )

    def _act(
        self, policy: Policy, state: Tensor, goal: Tensor, sigma: float
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Mean [n, 28], action [n, 28] and its log-density [n]; inference runs by blocks."""
        blocks = zip(state.split(self.block), goal.split(self.block), strict=True)
        mean = torch.cat([policy(*rows) for rows in blocks])
        noise = normal(self.seed, self._ids, self.shard.clock, policy.actions)
        action = mean + sigma * noise
        return mean, action, log_density(action, mean, sigma)

    def rewind(self) -> None:
        """Return the shard to the beginning of the last rollout, complete or not."""
        if self._before is not None:
            self.shard.load_state_dict(self._before)

    def state_dict(self) -> dict[str, Tensor]:
        """State of the shard; the worker itself has none."""
        return self.shard.state_dict()

    def load_state_dict(self, state: dict[str, Tensor]) -> None:
        """Restore what `state_dict` gave."""
        self._before = None
        self.shard.load_state_dict(state)


def _stacked(parts: list[Tensor | None]) -> Tensor | None:
    """Tensors of all steps [T, ..]; None where no step has one."""
    found = [part for part in parts if part is not None]
    return torch.stack(found) if found else None


def _finite_episodes(step: StepLike, values: Tensor) -> Tensor:
    """Values of the episodes in `end_ids`, without episodes that ended in a non-finite state."""
    if len(values) == len(step.end_ids):
        return values
    ended = (step.fell | step.timed_out | ~step.finite).nonzero().flatten()
    return values[step.finite[ended]]


def _in_order(rollout: Rollout) -> Rollout:
    """The rollout with its ends sorted by (t, n); a shard's order within a step may differ."""
    return Rollout.join([rollout])

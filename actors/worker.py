"""A rollout worker: one shard, stepped with published weights; it knows nothing of its fleet."""

import time
from collections.abc import Mapping
from typing import Protocol

import torch
from torch import Tensor

from policy.model.acting import Policy
from policy.model.networks import log_density
from policy.rollout import Rollout
from world.precision import decide
from world.random_streams import normal

#: What is published beside the weights for the shards.
WORLD = "world."


class StepLike(Protocol):
    """What a shard tells of one step; read only."""

    @property
    def reward(self) -> Tensor:
        """[n]: the task reward."""
        ...

    @property
    def fell(self) -> Tensor:
        """[n] bool."""
        ...

    @property
    def timed_out(self) -> Tensor:
        """[n] bool."""
        ...

    @property
    def finite(self) -> Tensor:
        """[n] bool: False voids the sample."""
        ...

    @property
    def end_ids(self) -> Tensor:
        """[K] int64: scenes of the shard whose episode ended."""
        ...

    @property
    def end_states(self) -> Tensor:
        """[K, S]: their last states."""
        ...

    @property
    def end_goals(self) -> Tensor:
        """[K, G]: their last goals."""
        ...

    @property
    def terms(self) -> Tensor:
        """[n, terms]: unweighted reward terms."""
        ...

    @property
    def episodes(self) -> Mapping[str, Tensor]:
        """[K] each: figures of the ended episodes."""
        ...

    @property
    def taught(self) -> Tensor | None:
        """[n, 28]: what a lesson says of the actions, NaN where nothing."""
        ...

    @property
    def led(self) -> Tensor | None:
        """[n] bool: where that was done."""
        ...


class ShardLike(Protocol):
    """Scenes stepped together; `world.episodes.shard.Shard` is one."""

    @property
    def clock(self) -> int:
        """Steps since it was made."""
        ...

    def observe(self) -> tuple[Tensor, Tensor]: ...
    def heed(self, told: Mapping[str, Tensor]) -> None: ...
    def step(self, action: Tensor) -> StepLike: ...
    def state_dict(self) -> dict[str, Tensor]: ...
    def load_state_dict(self, state: dict[str, Tensor]) -> None: ...


class Worker:
    """Rolls one shard out.

    Inference and noise go by fixed blocks of scenes, and noise is a function of (seed, scene,
    clock): the numbers do not depend on how the scenes are divided among workers.
    """

    def __init__(self, shard: ShardLike, scenes: range, seed: int, block: int = 64) -> None:
        self.shard = shard
        self.scenes = scenes
        self.seed = seed
        self.block = block
        self._ids = torch.arange(scenes.start, scenes.stop, dtype=torch.int64)
        self._policy: Policy | None = None

    def rollout(
        self, weights: Mapping[str, Tensor], version: int, horizon: int, sigma: float
    ) -> Rollout:
        """Act for `horizon` steps; [T, n, ..] of this shard's scenes."""
        if self._policy is None:
            self._policy = Policy(weights, decide("cpu"))
        else:
            self._policy.load(weights)
        told = {k.removeprefix(WORLD): v for k, v in weights.items() if k.startswith(WORLD)}
        if told:
            self.shard.heed(told)
        states, goals, actions, means, log_probs = [], [], [], [], []
        steps: list[StepLike] = []
        acting_s = world_s = 0.0
        began = time.perf_counter()
        state, goal = (x.clone() for x in self.shard.observe())
        world_s += time.perf_counter() - began
        for _ in range(horizon):
            began = time.perf_counter()
            states.append(state)
            goals.append(goal)
            mean, action, log_prob = self._act(self._policy, state, goal, sigma)
            means.append(mean)
            actions.append(action)
            log_probs.append(log_prob)
            acted = time.perf_counter()
            steps.append(self.shard.step(action))
            # The shard may hand out views of its own arrays, which the next step overwrites.
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
                    key: torch.cat([_of_sound(s, s.episodes[key]) for s in steps])
                    for key in steps[0].episodes
                },
                version=version,
                first_scene=self.scenes.start,
                seconds={"world": world_s, "policy": acting_s},
                taught=_lessons([s.taught for s in steps]),
                led=_lessons([s.led for s in steps]),
            )
        )

    def _act(
        self, policy: Policy, state: Tensor, goal: Tensor, sigma: float
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Mean [n, 28], action [n, 28] and its log-density [n]; inference block by block."""
        blocks = zip(state.split(self.block), goal.split(self.block), strict=True)
        mean = torch.cat([policy(*rows) for rows in blocks])
        noise = normal(self.seed, self._ids, self.shard.clock, policy.actions)
        action = mean + sigma * noise
        return mean, action, log_density(action, mean, sigma)

    def state_dict(self) -> dict[str, Tensor]:
        """The shard's state; the worker itself has none."""
        return self.shard.state_dict()

    def load_state_dict(self, state: dict[str, Tensor]) -> None:
        """Restore what `state_dict` gave."""
        self.shard.load_state_dict(state)


def _lessons(parts: list[Tensor | None]) -> Tensor | None:
    """Those of all steps, if there is a lesson."""
    found = [part for part in parts if part is not None]
    return torch.stack(found) if found else None


def _of_sound(step: StepLike, values: Tensor) -> Tensor:
    """Of values by episode, those in `end_ids`: an episode that blew up counts as none."""
    if len(values) == len(step.end_ids):
        return values
    ended = (step.fell | step.timed_out | ~step.finite).nonzero().flatten()
    return values[step.finite[ended]]


def _in_order(rollout: Rollout) -> Rollout:
    """Ends sorted by (t, n), as `Rollout` promises, whatever the shard's order within a step."""
    return Rollout.join([rollout])

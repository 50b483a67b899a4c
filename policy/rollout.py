"""The rollout of one iteration: T steps of N scenes, time-major, each state stored once."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise

import torch
from torch import Tensor

from world.device import put


class Abandoned(Exception):
    """A rollout or an update was ended before it was complete, because the training stops."""


@dataclass(frozen=True)
class Rollout:
    """states[t] --actions[t]--> rewards[t].

    Where an episode ended at t, states[t + 1] is already the next episode's first state and the
    true successor is in `end_states`, at the row of `end_index` that holds (t, n).
    """

    states: Tensor
    """[T+1, N, 114] float32"""
    goals: Tensor
    """[T+1, N, G] float32"""
    actions: Tensor
    """[T, N, 28] float32, unclipped, in units of the normalised action"""
    means: Tensor
    """[T, N, 28] float32, the mean that each action was drawn around (for the exact KL)"""
    log_probs: Tensor
    """[T, N] float32"""
    rewards: Tensor
    """[T, N] float32, task reward"""
    term_sums: Tensor
    """[N, terms] float64, unweighted reward terms summed over each scene's valid samples"""
    fell: Tensor
    """[T, N] bool: the episode ended in a terminal state, which is not bootstrapped"""
    timed_out: Tensor
    """[T, N] bool: the episode was truncated by a time limit or by success; bootstrapped"""
    valid: Tensor
    """[T, N] bool; False where the scene became non-finite: dropped and counted"""
    end_index: Tensor
    """[K, 2] int64 (t, n) of every episode that ended, sorted"""
    end_states: Tensor
    """[K, 114] float32"""
    end_goals: Tensor
    """[K, G] float32"""
    episodes: dict[str, Tensor]
    """return, length, success, fall, start: [K] each, in the order of `end_index`"""
    version: int
    """Version of the policy that acted"""
    first_scene: int
    """Global id of scene n = 0"""
    seconds: dict[str, float]
    """Wall time by part: world, policy"""
    teacher_action: Tensor | None = None
    """[T, N, 28] float32: the teacher's actions in these states, NaN where it labels nothing; None
    without a teacher"""

    @property
    def horizon(self) -> int:
        """Number of steps T."""
        return self.rewards.shape[0]

    @property
    def scenes(self) -> int:
        """Number of scenes N."""
        return self.rewards.shape[1]

    @property
    def samples(self) -> int:
        """Number of control steps over all scenes, including dropped ones."""
        return self.rewards.numel()

    def term_means(self, names: Sequence[str], of: Tensor | None = None) -> dict[str, float]:
        """Mean of each unweighted reward term over the valid samples, by name.

        of: [N, terms] bool: the terms that a scene has; None: every scene has all of them.
        """
        counts = self.valid.sum(0).double()
        rows = counts[:, None].expand_as(self.term_sums)
        if of is not None:
            rows = torch.where(of.to(rows.device), rows, 0.0)
        means = self.term_sums.sum(0) / rows.sum(0).clamp_min(1.0)
        return dict(zip(names, means.tolist(), strict=True))

    @staticmethod
    def join(parts: Sequence["Rollout"]) -> "Rollout":
        """Rollout of all scenes, in scene order, from parts in any order.

        The result does not depend on the division of the scenes, except for `seconds`, which are
        those of the slowest part. Raises ValueError for scenes that are missing or twice there.
        """
        parts = sorted(parts, key=lambda part: part.first_scene)
        for part, after in pairwise(parts):
            if part.first_scene + part.scenes != after.first_scene:
                raise ValueError(
                    f"parts of a rollout: scene {after.first_scene} follows"
                    f" {part.first_scene + part.scenes - 1}"
                )
        wide = ("states", "goals", "actions", "means", "log_probs", "rewards")
        wide += ("fell", "timed_out", "valid")
        wide += () if parts[0].teacher_action is None else ("teacher_action",)
        joined = {name: torch.cat([getattr(p, name) for p in parts], dim=1) for name in wide}
        shifts, shift = [], 0
        for part in parts:
            shifts.append(torch.tensor([0, shift], device=part.end_index.device))
            shift += part.scenes
        end_index = torch.cat([p.end_index + s for p, s in zip(parts, shifts, strict=True)])
        order = torch.argsort(end_index[:, 0] * shift + end_index[:, 1], stable=True)
        return Rollout(
            **joined,
            term_sums=torch.cat([p.term_sums for p in parts]),
            end_index=end_index[order],
            end_states=torch.cat([p.end_states for p in parts])[order],
            end_goals=torch.cat([p.end_goals for p in parts])[order],
            episodes={
                key: torch.cat([p.episodes[key] for p in parts])[order] for key in parts[0].episodes
            },
            version=min(p.version for p in parts),
            first_scene=parts[0].first_scene,
            seconds={k: max(p.seconds[k] for p in parts) for k in parts[0].seconds},
        )

    def on(self, device: torch.device) -> "Rollout":
        """The same on a device; itself where it is there. What is counted for people stays."""
        if self.states.device == device:
            return self
        found = {f.name: getattr(self, f.name) for f in fields(self)}
        tensors = {k: put(v, device) for k, v in found.items() if isinstance(v, Tensor)}
        return replace(self, **tensors)

    def tensors(self) -> dict[str, Tensor]:
        """All tensors by field name, episodes as `episodes.<key>`."""
        found = {f.name: getattr(self, f.name) for f in fields(self)}
        flat = {k: v for k, v in found.items() if isinstance(v, Tensor)}
        return flat | {f"episodes.{k}": v for k, v in self.episodes.items()}


def successors(along: Tensor, end_index: Tensor, at_end: Tensor) -> Tensor:
    """along[1:] with at_end [K, ..] put at end_index [K, 2]; [T+1, N, ..] -> [T, N, ..]."""
    following = along[1:].clone()
    following[end_index[:, 0], end_index[:, 1]] = at_end
    return following

"""What the loop needs of the others: a fleet that acts, a style that scores, a record, a store."""

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

from torch import Tensor

from policy.rollout import Rollout

State = dict[str, Any]
"""Nested dicts with string keys; leaves are tensors and JSON scalars."""


class Fleet(Protocol):
    """Workers that own all scenes between them."""

    def collect(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> Rollout:
        """Act for one horizon with the published weights; all scenes, in order."""
        ...

    def alive(self) -> int:
        """Workers that took part in the last collection."""
        ...

    def state_dict(self) -> State:
        """Everything that an exact restart needs."""
        ...

    def load_state_dict(self, state: State) -> None:
        """Restore what `state_dict` gave."""
        ...

    def close(self) -> None:
        """Let go of threads and processes."""
        ...


@runtime_checkable
class PrefetchingFleet(Protocol):
    """A fleet whose workers need not wait until the rollouts of all have been taken in."""

    def prefetch(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> None:
        """What the next `collect` will be called with, told while one is under way."""
        ...


class StyleScores(Protocol):
    """The style reward of one batch."""

    @property
    def reward(self) -> Tensor:
        """[T, N] float32."""
        ...

    @property
    def version(self) -> int:
        """Of the discriminator that gave it."""
        ...

    @property
    def metrics(self) -> Mapping[str, float]:
        """By `style/<name>`."""
        ...


class Style(Protocol):
    """A discriminator with its replay, in this process or behind a service."""

    def score(
        self,
        batch: int,
        rollout_states: Tensor,
        end_index: Tensor,
        end_states: Tensor,
        valid: Tensor,
    ) -> StyleScores:
        """Score states [T+1, N, 114] with the current version; insert them once per batch id."""
        ...

    def train(self, version: int) -> Mapping[str, float]:
        """Train the version after `version`; asked again for the same one, do nothing more."""
        ...

    def state_dict(self) -> State:
        """Everything that an exact restart needs."""
        ...

    def load_state_dict(self, state: State) -> None:
        """Restore what `state_dict` gave."""
        ...


class Recorder(Protocol):
    """Where metrics go."""

    def record(self, iteration: int, metrics: Mapping[str, float]) -> None:
        """One line: flat `group/name` numbers, `samples` and `seconds`."""
        ...


class Checkpointer(Protocol):
    """Where states go."""

    def save(self, iteration: int, state: State, best: bool = False) -> None:
        """Write sections policy, training, style; `best` also moves that name to it."""
        ...

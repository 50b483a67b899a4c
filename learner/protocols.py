"""Protocols of the training loop's parts: fleet, style, recorder and checkpointer."""

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

from torch import Tensor

from policy.rollout import Rollout

State = dict[str, Any]
"""Nested dicts with string keys; leaves are tensors and JSON scalars."""


class Fleet(Protocol):
    """Workers that together simulate all scenes."""

    def collect(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> Rollout:
        """Rollout of one horizon of all scenes, in scene order, with published weights."""
        ...

    def alive(self) -> int:
        """Number of workers that took part in the last collection."""
        ...

    def state_dict(self) -> State:
        """Everything that an exact restart needs."""
        ...

    def load_state_dict(self, state: State) -> None:
        """Restore what `state_dict` gave."""
        ...

    def close(self) -> None:
        """End threads and processes."""
        ...


@runtime_checkable
class PrefetchingFleet(Protocol):
    """A fleet whose workers can begin the next rollout before the present one is complete."""

    def prefetch(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> None:
        """Announce the arguments of the next `collect` during the present one."""
        ...


@runtime_checkable
class AbandoningFleet(Protocol):
    """A fleet that can end a collection before it is complete, to leave soon."""

    def abandon(self) -> None:
        """End this collection and all later ones within a control step: `collect` raises Abandoned.

        For any thread and for signal handlers: it waits for nothing.
        """
        ...

    def rewind(self) -> None:
        """Return all scenes to the beginning of the last collection, complete or not; not during
        one."""
        ...


class StyleScores(Protocol):
    """Style reward of one batch."""

    @property
    def reward(self) -> Tensor:
        """[T, N] float32."""
        ...

    @property
    def version(self) -> int:
        """Version of the discriminator that scored."""
        ...

    @property
    def metrics(self) -> Mapping[str, float]:
        """Metrics by `style/<name>`."""
        ...


class Style(Protocol):
    """A discriminator with its replay, in process or behind a service."""

    def score(
        self,
        batch: int,
        rollout_states: Tensor,
        end_index: Tensor,
        end_states: Tensor,
        valid: Tensor,
    ) -> StyleScores:
        """Score states [T+1, N, 114] with the current version; insert them once per batch id.

        Layouts of the arguments as in `discriminator.trainer.Discriminator.score`.
        """
        ...

    def train(self, version: int) -> Mapping[str, float]:
        """Train `version` + 1 from `version`, once; a repeated call returns the same metrics."""
        ...

    def state_dict(self) -> State:
        """Everything that an exact restart needs."""
        ...

    def load_state_dict(self, state: State) -> None:
        """Restore what `state_dict` gave."""
        ...


class Recorder(Protocol):
    """Sink of metrics."""

    def record(self, iteration: int, metrics: Mapping[str, float]) -> None:
        """Write an iteration's metrics: flat `group/name` numbers, `samples` and `seconds`."""
        ...


class Checkpointer(Protocol):
    """Store of checkpoints."""

    def save(self, iteration: int, state: State, best: bool = False) -> None:
        """Write the sections policy, training and style; `best` also points that name at it."""
        ...

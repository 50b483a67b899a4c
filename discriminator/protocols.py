"""Protocol of the mocap sampler, and the scores that the discriminator returns."""

from dataclasses import dataclass, field
from typing import Any, Protocol

import torch
from torch import Tensor


class MocapSampler(Protocol):
    """Windows of consecutive mocap states, drawn by a counter: the same counter gives the same
    batch. All have the same number of states, 2 for transitions."""

    def sample(self, n: int, counter: int) -> tuple[Tensor, ...]:
        """Windows for training: their states in order, [n, F] float32 each."""
        ...

    def held_out(self, n: int, counter: int) -> tuple[Tensor, ...]:
        """Held-out windows, likewise."""
        ...


@dataclass(frozen=True)
class Holding:
    """How a box in hand is told from a state, and what is hidden then (masked adversarial motion
    priors)."""

    hands: Tensor
    """[2, 3] int64: features of the positions of both hands."""
    box: Tensor
    """[3] int64: features of the box's position, in the same frame."""
    within_m: float
    """Both hands are this near to the box's centre."""
    hidden: Tensor
    """[F] bool: features that are hidden while it is in hand."""

    def to_json(self) -> dict[str, Any]:
        """As JSON values."""
        lists = {name: getattr(self, name).tolist() for name in ("hands", "box", "hidden")}
        return lists | {"within_m": self.within_m}

    @staticmethod
    def from_json(value: dict[str, Any]) -> "Holding":
        """The inverse of `to_json`."""
        hands, box = torch.tensor(value["hands"]), torch.tensor(value["box"])
        return Holding(hands, box, float(value["within_m"]), torch.tensor(value["hidden"]))


@dataclass(frozen=True)
class StyleScores:
    """Style rewards of a rollout, and the version of the discriminator that scored it."""

    reward: Tensor
    """[T, N] float32, 0 where the transition is not valid."""
    version: int
    """Version k of the discriminator D_k that scored."""
    metrics: dict[str, float] = field(default_factory=dict)
    """Values by `group/name`."""

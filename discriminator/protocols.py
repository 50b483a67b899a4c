"""Protocol of the mocap sampler, and the scores that the discriminator returns."""

from dataclasses import dataclass, field
from typing import Protocol

from torch import Tensor


class MocapSampler(Protocol):
    """Mocap transitions, drawn by a counter: the same counter gives the same batch."""

    def sample(self, n: int, counter: int) -> tuple[Tensor, Tensor]:
        """Training transitions: states and successors, [n, F] float32 each."""
        ...

    def held_out(self, n: int, counter: int) -> tuple[Tensor, Tensor]:
        """Held-out transitions: states and successors, [n, F] float32 each."""
        ...


@dataclass(frozen=True)
class StyleScores:
    """Style rewards of a rollout, and the version of the discriminator that scored it."""

    reward: Tensor
    """[T, N] float32, 0 where the transition is not valid."""
    version: int
    """Version k of the discriminator D_k that scored."""
    metrics: dict[str, float] = field(default_factory=dict)
    """Values by `group/name`."""

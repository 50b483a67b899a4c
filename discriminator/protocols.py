"""What the discriminator needs of the mocap, and what it gives back."""

from dataclasses import dataclass, field
from typing import Protocol

from torch import Tensor


class MocapSampler(Protocol):
    """Transitions of the motion capture, drawn by counter: the same counter, the same batch."""

    def sample(self, n: int, counter: int) -> tuple[Tensor, Tensor]:
        """Training transitions: states and their successors, [n, F] float32 each."""
        ...

    def held_out(self, n: int, counter: int) -> tuple[Tensor, Tensor]:
        """Transitions of the held-out share, [n, F] float32 each."""
        ...


@dataclass(frozen=True)
class StyleScores:
    """Style rewards of a rollout and the discriminator version that gave them."""

    reward: Tensor
    """[T, N] float32, 0 where the transition is not valid."""
    version: int
    """Version k of the D_k that scored."""
    metrics: dict[str, float] = field(default_factory=dict)
    """`group/name` to value."""

"""A reflection of vectors of features or actions: each number is another one, or its negative; and
policies that know one side alone."""

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class Reflection:
    """x -> sign · x[index], its own inverse."""

    index: Tensor
    """[d] int64."""
    sign: Tensor
    """[d] of 1 and −1."""

    def __call__(self, x: Tensor) -> Tensor:
        """The images of vectors [..., d]."""
        return x[..., self.index] * self.sign.to(x.dtype)

    def where(self, chosen: Tensor, x: Tensor) -> Tensor:
        """The images of those vectors [..., d] that are chosen [...], bool; the others as they
        are."""
        return torch.where(chosen[..., None], self(x), x)


@dataclass(frozen=True)
class Symmetry:
    """What left and right are to a policy: the mirrored observation calls for the mirrored
    action."""

    observation: Reflection
    """Of the state followed by the goal."""
    action: Reflection
    sides: Tensor | None = None
    """[4] int64: where the horizontal coordinates of two directions stand in the observation, of
    the first and of the second. Where the second points to the right of the first, the networks see
    and act in the mirror (Abdolhosseini et al. 2019, "On Learning Symmetric Locomotion", phase-free
    symmetric networks): what they learn on one side holds on the other. None: they see everything
    as it is."""

    def canonical(self, observation: Tensor) -> tuple[Tensor, Tensor | None]:
        """What networks see of observations [..., d]; and of which [...], bool, it is the mirror
        image (None: of none)."""
        if self.sides is None:
            return observation, None
        x, y, second_x, second_y = observation[..., self.sides].unbind(-1)
        right = x * second_y - y * second_x < 0.0
        return self.observation.where(right, observation), right

    def restored(self, action: Tensor, right: Tensor | None) -> Tensor:
        """Actions [..., a] for what networks said to what `seen` gave; and the other way round."""
        return action if right is None else self.action.where(right, action)

    def tensors(self) -> dict[str, Tensor]:
        """Itself as tensors, for `of`; empty where there are no sides."""
        if self.sides is None:
            return {}
        return {
            "sides": self.sides,
            "observation_index": self.observation.index,
            "observation_sign": self.observation.sign,
            "action_index": self.action.index,
            "action_sign": self.action.sign,
        }

    @staticmethod
    def of(tensors: Mapping[str, Tensor]) -> "Symmetry | None":
        """What `tensors` gave; None where that was empty."""
        if not tensors:
            return None

        def reflection(what: str) -> Reflection:
            return Reflection(tensors[f"{what}_index"], tensors[f"{what}_sign"])

        return Symmetry(reflection("observation"), reflection("action"), tensors["sides"])

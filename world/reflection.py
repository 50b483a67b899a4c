"""Reflections of feature and action vectors, and the symmetry of policies that learn one side
alone."""

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class Reflection:
    """The map x -> sign · x[index], which is its own inverse."""

    index: Tensor
    """[d] int64."""
    sign: Tensor
    """[d] of 1 and −1."""

    def __call__(self, x: Tensor) -> Tensor:
        """The images of vectors [..., d]."""
        return x[..., self.index] * self.sign.to(x.dtype)

    def where(self, chosen: Tensor, x: Tensor) -> Tensor:
        """Vectors [..., d], those chosen [...] bool replaced by their images."""
        return torch.where(chosen[..., None], self(x), x)


@dataclass(frozen=True)
class Symmetry:
    """Left-right symmetry of a policy: the action in a mirrored observation is the mirrored
    action."""

    observation: Reflection
    """Reflection of the state followed by the goal."""
    action: Reflection
    sides: Tensor | None = None
    """[4] int64: indices in the observation of the horizontal coordinates of two directions. Where
    the second points to the right of the first, the networks observe the mirror image and their
    action is mirrored (Abdolhosseini et al. 2019, "On Learning Symmetric Locomotion", phase-free
    symmetric networks), so that one side is learned for both. None: nothing is mirrored."""

    def canonical(self, observation: Tensor) -> tuple[Tensor, Tensor | None]:
        """Observations [..., d] of the networks, mirrored where needed, and where [...] bool they
        are mirrored; None: nowhere."""
        if self.sides is None:
            return observation, None
        x, y, second_x, second_y = observation[..., self.sides].unbind(-1)
        right = x * second_y - y * second_x < 0.0
        return self.observation.where(right, observation), right

    def restored(self, action: Tensor, right: Tensor | None) -> Tensor:
        """Actions [..., a] mirrored where `right` [...] bool, as `canonical` returned it; its own
        inverse."""
        return action if right is None else self.action.where(right, action)

    def tensors(self) -> dict[str, Tensor]:
        """The symmetry as tensors, for `of`; empty without sides."""
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
        """The symmetry of what `tensors` returned; None where that was empty."""
        if not tensors:
            return None

        def reflection(what: str) -> Reflection:
            return Reflection(tensors[f"{what}_index"], tensors[f"{what}_sign"])

        return Symmetry(reflection("observation"), reflection("action"), tensors["sides"])

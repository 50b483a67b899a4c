"""The mapping between actions and the servos' set-points."""

from dataclasses import dataclass

import torch
from torch import Tensor

from world.character import model as character


@dataclass(frozen=True)
class ActionMap:
    """Set-points of the 28 servos as offset + scale * action, within their bounds.

    All tensors are [28] rad, of one precision.
    """

    offset: Tensor
    """Set-points of action 0."""
    scale: Tensor
    """Change of the set-points from action 0 to action 1."""
    low: Tensor
    """Least set-points."""
    high: Tensor
    """Greatest set-points."""
    clip: float
    """Greatest magnitude of an action; larger ones are clipped."""

    @staticmethod
    def of(action_scale: float, action_clip: float, dtype: torch.dtype) -> "ActionMap":
        """Return the mapping of a world's `action_scale` and `action_clip`.

        The scale is computed in `dtype`: float64 for simulation, float32 for networks.
        """
        low, high = (torch.from_numpy(bound).to(dtype) for bound in character.set_point_bounds())
        offset = torch.from_numpy(character.neutral_set_points()).to(dtype)
        return ActionMap(offset, action_scale * (high - low), low, high, action_clip)

    def set_points(self, actions: Tensor, base: Tensor | None = None) -> Tensor:
        """Return the set-points [n, 28] rad, within their bounds, of actions [n, 28].

        base: set-points [n, 28] rad of action 0, instead of `offset`.
        """
        offset = self.offset if base is None else base.to(self.offset)
        return self.bounded(offset + self.scale * actions.clamp(-self.clip, self.clip))

    def actions(self, set_points: Tensor) -> Tensor:
        """Return the actions [n, 28], within their clip, that give set-points [n, 28] rad."""
        return ((set_points - self.offset) / self.scale).clamp(-self.clip, self.clip)

    def bounded(self, set_points: Tensor) -> Tensor:
        """Return set-points [n, 28] rad clipped to the bounds of the servos."""
        return torch.maximum(torch.minimum(set_points, self.high), self.low)

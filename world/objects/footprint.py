"""The footprint of furniture on the floor, and the edge at which a character gets on."""

from dataclasses import dataclass

import torch
from torch import Tensor

#: Front corners that are seen apart by this much, m, have a notch between them: use points give
#: them apart by 0.2 m or not at all.
_NOTCH_M = 0.10
#: In a notch a character stands so far aside of the use point, away from the part that reaches
#: forward, m.
_ASIDE_M = 0.30


@dataclass(frozen=True)
class Footprint:
    """Bounding rectangles of n pieces on the floor, in the target's frame: origin at the use point,
    +x along its facing."""

    low: Tensor
    """[n, 2] m."""
    high: Tensor
    """[n, 2] m."""
    edge: Tensor
    """[n] m: x of the edge at which one gets on: the front, or of a piece such as an L-shaped sofa
    the end of the notch before the use point."""
    aside: Tensor
    """[n] m: y of the middle of that notch; 0 without one."""

    @classmethod
    def of(cls, corners: Tensor) -> "Footprint":
        """The footprint of corners [n, 8, 2], m, of that frame, in the use point's order."""
        low, high = corners.amin(dim=1), corners.amax(dim=1)
        # from the back corner to the front corner of either side: right, left
        right = (corners[:, 4] - corners[:, 0]).norm(dim=1)
        left = (corners[:, 6] - corners[:, 2]).norm(dim=1)
        depth = (left - right).abs()
        notched = depth > _NOTCH_M
        aside = torch.where(left < right, _ASIDE_M, -_ASIDE_M)
        return cls(
            low,
            high,
            torch.where(notched, high[:, 0] - depth, high[:, 0]),
            torch.where(notched, aside, 0.0),
        )

    def holds(self, offset: Tensor, margin_m: float = 0.0) -> Tensor:
        """[n] bool: whether the points [n, 2] of that frame lie within margin_m of the
        rectangles."""
        inside = (offset > self.low - margin_m) & (offset < self.high + margin_m)
        return inside.all(dim=1)

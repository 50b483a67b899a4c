"""Where episodes fail, by segment of what they follow, so that more of them start there.

Counts are of joined rollouts, in scene order: the same over any number of actors.
"""

from collections.abc import Mapping

import torch
from torch import Tensor

#: Under this name episodes tell the segment that they ended in, and workers are told the counts.
SEGMENT, PUBLISHED = "segment", "world.failures"
#: Share of the counts that an iteration keeps.
_DECAY = 0.98


class Failures:
    """Recent failures by segment; nothing for tasks whose episodes have none."""

    def __init__(self) -> None:
        self._counts = torch.zeros(0)

    def add(self, episodes: Mapping[str, Tensor]) -> None:
        """Count the finished episodes [K] of an iteration."""
        if SEGMENT not in episodes:
            return
        told = torch.isfinite(episodes[SEGMENT])  # those of other tasks have none
        segment, fall = episodes[SEGMENT][told].long(), episodes["fall"][told]
        most = max([len(self._counts), *(segment + 1).tolist()])
        counts = torch.zeros(most)
        counts[: len(self._counts)] = _DECAY * self._counts
        # integers up to 2^24 are exact: the order of additions does not matter
        self._counts = counts + torch.bincount(segment, weights=fall.double(), minlength=most).to(
            torch.float32
        )

    def published(self) -> dict[str, Tensor]:
        """What workers are told with the weights: [S] decayed counts; empty before any."""
        return {PUBLISHED: self._counts.clone()} if len(self._counts) else {}

    def state_dict(self) -> dict[str, Tensor]:
        """Everything that an exact restart needs."""
        return {"counts": self._counts}

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Restore what `state_dict` gave."""
        self._counts = state["counts"].clone()

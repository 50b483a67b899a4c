"""Where episodes fail, so that more of them start there: by segment of a reference motion, and by
piece of furniture.

Counts are of joined rollouts, in scene order: the same over any number of actors.
"""

from collections.abc import Mapping

import torch
from torch import Tensor

#: Under these names episodes tell the segment that they ended in, or the piece that they had, and
#: workers are told the counts of the first, the failure rates of the second.
SEGMENT, PUBLISHED = "segment", "world.failures"
PIECE, PUBLISHED_PIECES = "piece", "world.pieces"
#: Share of the counts that an iteration keeps.
_DECAY = 0.98


class Failures:
    """Recent falls by segment, recent episodes and failures by piece; nothing for tasks whose
    episodes have none."""

    def __init__(self) -> None:
        self._counts = torch.zeros(0)
        self._pieces = torch.zeros(2, 0)

    def add(self, episodes: Mapping[str, Tensor]) -> None:
        """Count the finished episodes [K] of an iteration."""
        if SEGMENT in episodes:
            told, segment = _numbers(episodes[SEGMENT])
            self._counts = _added(self._counts[None], segment, [episodes["fall"][told]])[0]
        if PIECE in episodes:
            told, piece = _numbers(episodes[PIECE])
            failed = 1.0 - episodes["success"][told]
            self._pieces = _added(self._pieces, piece, [torch.ones_like(failed), failed])

    def published(self) -> dict[str, Tensor]:
        """What workers are told with the weights, each once there is any: decayed counts of falls
        [S], and failure rates of pieces [P], NaN for those without an episode."""
        found = {PUBLISHED: self._counts.clone()} if len(self._counts) else {}
        ended, failed = self._pieces
        return found | ({PUBLISHED_PIECES: failed / ended} if len(ended) else {})

    def state_dict(self) -> dict[str, Tensor]:
        """Everything that an exact restart needs."""
        return {"counts": self._counts, "pieces": self._pieces}

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Restore what `state_dict` gave."""
        self._counts = state["counts"].clone()
        if "pieces" in state:  # older runs counted none
            self._pieces = state["pieces"].clone()


def _numbers(told: Tensor) -> tuple[Tensor, Tensor]:
    """Which episodes [K] bool told a number, for those of other tasks have none, and theirs."""
    finite = torch.isfinite(told)
    return finite, told[finite].long()


def _added(counts: Tensor, number: Tensor, values: list[Tensor]) -> Tensor:
    """Decayed counts [R, S] with R rows of values [k] each added at the numbers [k]; S grows."""
    most = max([counts.shape[1], *(number + 1).tolist()])
    grown = torch.zeros(len(counts), most)
    grown[:, : counts.shape[1]] = _DECAY * counts
    # integers up to 2^24 are exact: the order of additions does not matter
    sums = [torch.bincount(number, weights=row.double(), minlength=most) for row in values]
    return grown + torch.stack(sums).to(torch.float32)

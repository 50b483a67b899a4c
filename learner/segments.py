"""Where episodes fail, so that more of them start there: by segment of a reference motion, and by
piece of furniture.

Counts are of joined rollouts, in scene order: the same over any number of actors.
"""

from collections.abc import Mapping

import torch
from torch import Tensor

#: Under this name episodes tell the segment that they ended in, and workers are told the counts.
SEGMENT, PUBLISHED = "segment", "world.failures"
#: Names that begin so tell the piece that an episode had, of one usage each, as piece_sit; workers
#: are told the failure rates, as world.piece_sit.
PIECE, WORLD = "piece_", "world."
#: Share of the counts that an iteration keeps.
_DECAY = 0.98


class Failures:
    """Recent falls by segment, recent episodes and failures by piece; nothing for tasks whose
    episodes have none."""

    def __init__(self) -> None:
        self._counts = torch.zeros(0)
        self._pieces: dict[str, Tensor] = {}

    def add(self, episodes: Mapping[str, Tensor]) -> None:
        """Count the finished episodes [K] of an iteration."""
        if SEGMENT in episodes:
            told, segment = _numbers(episodes[SEGMENT])
            self._counts = _added(self._counts[None], segment, [episodes["fall"][told]])[0]
        for name in filter(_is_piece, episodes):
            told, piece = _numbers(episodes[name])
            failed = 1.0 - episodes["success"][told]
            counts = self._pieces.get(name, torch.zeros(2, 0))
            self._pieces[name] = _added(counts, piece, [torch.ones_like(failed), failed])

    def published(self) -> dict[str, Tensor]:
        """What workers are told with the weights, each once there is any: decayed counts of falls
        [S], and failure rates of pieces [P], NaN for those without an episode."""
        found = {PUBLISHED: self._counts.clone()} if len(self._counts) else {}
        rates = {WORLD + name: failed / ended for name, (ended, failed) in self._pieces.items()}
        return found | {name: rate for name, rate in rates.items() if len(rate)}

    def state_dict(self) -> dict[str, Tensor]:
        """Everything that an exact restart needs."""
        return {"counts": self._counts, **self._pieces}

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Restore what `state_dict` gave."""
        self._counts = state["counts"].clone()
        self._pieces = {name: state[name].clone() for name in filter(_is_piece, state)}


def _is_piece(name: str) -> bool:
    return name.startswith(PIECE)


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

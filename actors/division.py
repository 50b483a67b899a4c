"""How many blocks of scenes each actor gets, so that all are done at the same time."""

import heapq
from collections.abc import Mapping, Sequence

import numpy as np

from actors.ray_actor import Arrays


def block_counts(blocks: int, costs: Sequence[float]) -> list[int]:
    """Blocks of each actor, so that the last one is done as early as can be.

    costs: seconds a block of each actor. A slow one may get none. Of equals the first gets more.
    """
    counts = [0] * len(costs)
    done = [(cost, index) for index, cost in enumerate(costs)]
    heapq.heapify(done)
    for _ in range(blocks):
        _, index = done[0]
        counts[index] += 1
        heapq.heapreplace(done, ((counts[index] + 1) * costs[index], index))
    return counts


def makespan(counts: Sequence[int], costs: Sequence[float]) -> float:
    """Seconds until the last actor is done."""
    return max(count * cost for count, cost in zip(counts, costs, strict=True))


def consecutive_ranges(counts: Sequence[int], block: int) -> list[range]:
    """Ranges of scenes in order, some of them empty."""
    ranges, first = [], 0
    for count in counts:
        ranges.append(range(first, first + count * block))
        first += count * block
    return ranges


def within(inner: range, outer: range) -> bool:
    """Whether all of `inner` lies in `outer`."""
    return outer.start <= inner.start and inner.stop <= outer.stop


def rows(state: Arrays, held: range, wanted: range) -> Arrays:
    """The state of the scenes `wanted`, out of that of `held`: views."""
    first, last = wanted.start - held.start, wanted.stop - held.start
    return {
        key: value[first:last] if value.ndim and len(value) == len(held) else value
        for key, value in state.items()
    }


def state_of_scenes(wanted: range, parts: Mapping[range, Arrays]) -> Arrays:
    """The state of the scenes `wanted` out of parts that hold them between them."""
    pieces = [
        rows(state, held, range(max(held.start, wanted.start), min(held.stop, wanted.stop)))
        for held, state in sorted(parts.items(), key=lambda item: item[0].start)
        if held.start < wanted.stop and wanted.start < held.stop
    ]
    if len(pieces) == 1:
        return pieces[0]
    return {
        key: np.concatenate([piece[key] for piece in pieces]) if first.ndim else first
        for key, first in pieces[0].items()
    }

"""Division of blocks of scenes over actors of different speeds."""

import heapq
from collections.abc import Mapping, Sequence

import numpy as np

from actors.ray_actor import Arrays


def block_counts(blocks: int, costs: Sequence[float]) -> list[int]:
    """Number of blocks of each actor that minimises the time until the last actor is done.

    costs: seconds per block of each actor. A slow actor may get 0 blocks. Of equally fast actors
    the first ones get more.
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
    """Consecutive ranges of scenes of `counts` blocks each; some may be empty."""
    ranges, first = [], 0
    for count in counts:
        ranges.append(range(first, first + count * block))
        first += count * block
    return ranges


def within(inner: range, outer: range) -> bool:
    """Whether all of `inner` lies in `outer`."""
    return outer.start <= inner.start and inner.stop <= outer.stop


def rows(state: Arrays, held: range, wanted: range) -> Arrays:
    """State of the scenes `wanted`, as views of the state of the scenes `held`."""
    first, last = wanted.start - held.start, wanted.stop - held.start
    return {
        key: value[first:last] if value.ndim and len(value) == len(held) else value
        for key, value in state.items()
    }


def state_of_scenes(wanted: range, parts: Mapping[range, Arrays]) -> Arrays:
    """State of the scenes `wanted`, from the states of parts that together contain them."""
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

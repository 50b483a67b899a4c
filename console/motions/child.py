"""Child processes that read motions, with limits of time and memory by the size of the file."""

import contextlib
import itertools
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from console.run import machine
from console.terminal import progress
from world import bounded

CPU_S, CPU_S_PER_MB = 10.0, 30.0
"""Limit of the processor time of a motion: a constant, and a part per megabyte of its file."""
WALL_FACTOR = 8.0
"""Limit of the wall time on a busy machine, as a multiple of that of the processor time."""
MEMORY_BYTES = 2 * 1024**3
"""Limit of the address space of a motion beyond that of an idle child process."""
ADVICE = "cut the motion into shorter ones, or leave it out"


def task(path: Path, arguments: tuple[Any, ...]) -> bounded.Task:
    """Return the task of one file, with limits by its size."""
    size = 0.0
    with contextlib.suppress(OSError):
        size = path.stat().st_size / 1e6
    cpu_s = CPU_S + CPU_S_PER_MB * size
    bounds = bounded.Bounds(cpu_s, WALL_FACTOR * cpu_s, MEMORY_BYTES)
    return bounded.Task(str(path), arguments, bounds)


def in_order(
    tasks: Sequence[bounded.Task], work: Callable[..., Any], stage: str
) -> Iterator[bounded.Result]:
    """Yield the results of the tasks in their order; the tasks run on all cores.

    stage: what they do, for the progress.
    """
    ready: dict[int, bounded.Result] = {}
    upcoming = 0
    workers = min(machine.cores(), len(tasks))
    done = itertools.count(1)
    with progress("motions", len(tasks), stage) as update:
        for index, result in bounded.run(tasks, work, workers, ADVICE, PRELOAD):
            update(next(done))
            ready[index] = result
            while upcoming in ready:
                yield ready.pop(upcoming)
                upcoming += 1


PRELOAD = ("world.motions.retarget.convert",)

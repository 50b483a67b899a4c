"""Motions read in processes of their own, within time and memory that fit the file."""

import contextlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from console.run import machine
from world import bounded

CPU_S, CPU_S_PER_MB = 10.0, 30.0
"""Processor time that a motion may take: at least, and for each megabyte of its file."""
WALL_FACTOR = 8.0
"""Of the processor time: what it may take in all on a busy machine."""
MEMORY_BYTES = 2 * 1024**3
"""Address space that a motion may take beyond what its process begins with."""
ADVICE = "cut the motion into shorter ones, or leave it out"


def task(path: Path, arguments: tuple[Any, ...]) -> bounded.Task:
    """The work on one file, with the bounds of its size."""
    size = 0.0
    with contextlib.suppress(OSError):
        size = path.stat().st_size / 1e6
    cpu_s = CPU_S + CPU_S_PER_MB * size
    bounds = bounded.Bounds(cpu_s, WALL_FACTOR * cpu_s, MEMORY_BYTES)
    return bounded.Task(str(path), arguments, bounds)


def in_order(tasks: Sequence[bounded.Task], work: Callable[..., Any]) -> Iterator[bounded.Result]:
    """The tasks' results in their order, all cores busy."""
    ready: dict[int, bounded.Result] = {}
    upcoming = 0
    workers = min(machine.cores(), len(tasks))
    for index, result in bounded.run(tasks, work, workers, ADVICE, PRELOAD):
        ready[index] = result
        while upcoming in ready:
            yield ready.pop(upcoming)
            upcoming += 1


PRELOAD = ("world.motions.retarget.convert",)

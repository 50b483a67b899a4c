"""`inhabit bench fuzz`: readers against randomly damaged files.

A file of each format is damaged by seeds and read by the program's reader. A refusal is one line
that names the file. Any other exception, a refusal of several lines or without the file, an end of
the process, or a file beyond the limits of time or memory is a fault.
"""

import collections
import functools
import tempfile
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from console.bench.fuzzing import files
from console.bench.fuzzing.mutations import mutated
from rpc.errors import RpcError
from world import bounded
from world.errors import InhabitError

BOUNDS = bounded.Bounds(cpu_s=20.0, wall_s=120.0, memory_bytes=2 << 30)
"""Limits of one damaged file; a chunk has as much again for every five files."""
CHUNK = 200
PRELOAD = ("torch", "trimesh", "world.motions.retarget.convert")


def measure(
    mutations: int, workers: int, formats: tuple[str, ...] = (), first: int = 0
) -> dict[str, float]:
    """Return counts over all formats and of each; `first`: the first seed."""
    counts, _ = survey(mutations, workers, formats, first)
    return counts


def survey(
    mutations: int,
    workers: int,
    formats: tuple[str, ...] = (),
    first: int = 0,
    note: Callable[[float], None] = lambda done: None,
) -> tuple[dict[str, float], list[str]]:
    """Return the counts of `measure`, and a line on every fault: format, seed, error.

    note: called with the mutations so far.
    """
    names = formats or names_of()
    each = -(-mutations // len(names))
    work = [
        (name, start, min(CHUNK, first + each - start))
        for name in names
        for start in range(first, first + each, CHUNK)
    ]
    total: collections.Counter[str] = collections.Counter()
    faults: list[str] = []
    while work:
        tasks = [_task(chunk) for chunk in work]
        again: list[tuple[str, int, int]] = []
        for index, result in bounded.run(tasks, damaged, workers, preload=PRELOAD):
            name, start, count = work[index]
            if result.died or result.refused:
                # a fault ends its chunk: halving finds the file
                if count > 1:
                    half = count // 2
                    again += [(name, start, half), (name, start + half, count - half)]
                else:
                    _count(total, name, {"mutations": 1, "crashes": 1})
                    faults.append(f"{name} {start}: {result.refused}")
            else:
                _count(total, name, result.value["counts"])
                faults += result.value["faults"]
            note(total["mutations"])
        work = again
    kinds = ("mutations", "reads", "refusals", "exceptions", "crashes")
    figures = {kind: float(total[kind]) for kind in kinds}
    for name in names:
        figures |= {f"{name}/{kind}": float(total[f"{name}/{kind}"]) for kind in kinds[1:]}
    return figures, faults


@functools.cache
def _samples() -> dict[str, files.Sample]:
    with tempfile.TemporaryDirectory() as folder:
        return files.samples(Path(folder))


def names_of() -> tuple[str, ...]:
    """Return the names of the formats."""
    return tuple(_samples())


def damaged(name: str, start: int, count: int) -> dict[str, Any]:
    """Read a format's file with the damage of `count` seeds; runs in a child process."""
    warnings.simplefilter("ignore")
    sample = _samples()[name]
    counts: collections.Counter[str] = collections.Counter()
    faults = []
    with tempfile.TemporaryDirectory() as folder:
        for other, content in sample.beside:
            Path(folder, other).write_bytes(content)
        path = Path(folder, sample.name)
        for seed in range(start, start + count):
            path.write_bytes(mutated(sample, seed))
            counts["mutations"] += 1
            kind, fault = outcome(sample.read, path)
            counts[kind] += 1
            if fault:
                faults.append(f"{name} {seed}: {fault}")
    return {"counts": dict(counts), "faults": faults}


def outcome(read: Callable[[Path], Any], path: Path) -> tuple[str, str]:
    """Return the result of reading a file, reads, refusals or exceptions, and a fault or ""."""
    try:
        read(path)
    except (InhabitError, RpcError) as error:
        text = str(error)
        stem = path.name.split(".")[0]
        if "\n" in text or not (stem in text or path.parent.name in text):
            return "exceptions", f"not one line with the file: {text[:200]!r}"
        return "refusals", ""
    except Exception as error:
        return "exceptions", f"{type(error).__name__}: {str(error)[:200]}"
    return "reads", ""


def _task(chunk: tuple[str, int, int]) -> bounded.Task:
    name, start, count = chunk
    factor = 1 + (count - 1) / 5
    bounds = bounded.Bounds(BOUNDS.cpu_s * factor, BOUNDS.wall_s * factor, BOUNDS.memory_bytes)
    return bounded.Task(f"{name} {start}", (name, start, count), bounds)


def _count(total: collections.Counter[str], name: str, counts: dict[str, int]) -> None:
    for kind, number in counts.items():
        total[kind] += number
        total[f"{name}/{kind}"] += number


def shown(faults: list[str]) -> Iterator[str]:
    """Yield the faults, one of each kind."""
    seen: set[str] = set()
    for fault in faults:
        name, _, rest = fault.partition(" ")
        kind = f"{name} {rest.partition(': ')[2][:50]}"
        if kind not in seen:
            seen.add(kind)
            yield fault

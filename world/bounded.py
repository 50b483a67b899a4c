"""Work on untrusted files, each in its own process with bounded time and memory.

Results are returned as JSON: nothing that a damaged process sends is unpickled. A file that crashes
its process affects no other.
"""

import contextlib
import json
import multiprocessing
import os
import resource
import signal
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from world.errors import InhabitError
from world.refusals import one_line
from world.surroundings import settle_sockets

MAX_ANSWER_BYTES = 1 << 28
LOOK_S = 0.2


@dataclass(frozen=True)
class Bounds:
    """Bounds of one piece of work."""

    cpu_s: float
    """Processor time, s."""
    wall_s: float
    """Wall-clock time, s: a hanging disk takes no processor time."""
    memory_bytes: int
    """Address space beyond what the process begins with."""


@dataclass(frozen=True)
class Task:
    """One piece of work."""

    name: str
    """First words of a refusal."""
    arguments: tuple[Any, ...]
    bounds: Bounds


@dataclass(frozen=True)
class Result:
    """Result of a task."""

    value: Any
    """Return value of the work, after JSON; None where it was refused."""
    refused: str
    """Reason of the refusal in one line; empty without one."""
    died: bool = False
    """Whether the process ended without an answer, or was ended."""


@dataclass
class _Running:
    index: int
    task: Task
    process: Any
    ends_at: float


def run(
    tasks: Iterable[Task],
    work: Callable[..., Any],
    workers: int,
    advice: str = "",
    preload: Sequence[str] = (),
    stopped: Callable[[], bool] = lambda: False,
) -> Iterator[tuple[int, Result]]:
    """Yield results of `work(*arguments)` with the tasks' indices, as they end.

    Args:
        tasks: the work; taken one by one as workers become free.
        work: a function of a module, called in a process of its own for each task.
        workers: processes at a time.
        advice: remedy, for the refusal of a file that exceeds its bounds.
        preload: modules that are imported before the processes start.
        stopped: called several times a second; true ends all running tasks, without results.
    Running tasks are ended when the iterator is closed, or by Ctrl-C.
    """
    settle_sockets()
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([work.__module__, *preload])
    running: dict[Any, _Running] = {}
    queue = enumerate(tasks)
    try:
        while True:
            while len(running) < max(1, workers) and (following := next(queue, None)):
                index, task = following
                ours, theirs = context.Pipe(duplex=False)
                process = context.Process(
                    target=_child, args=(theirs, work, task, advice), daemon=True
                )
                process.start()
                theirs.close()
                ends_at = time.monotonic() + task.bounds.wall_s
                running[ours] = _Running(index, task, process, ends_at)
            if not running:
                return
            first = min(one.ends_at for one in running.values())
            ready = wait(list(running), min(LOOK_S, max(0.0, first - time.monotonic())))
            if stopped():
                return
            for end in ready:
                assert isinstance(end, Connection)
                one = running.pop(end)
                yield one.index, _received(end, one, advice)
            now = time.monotonic()
            late = [end for end, one in running.items() if one.ends_at <= now]
            for end in late:
                one = running.pop(end)
                one.process.kill()
                one.process.join()
                end.close()
                text = f"not done after {one.task.bounds.wall_s:.0f} s"
                yield one.index, Result(None, _advised(one.task, text, advice), died=True)
    finally:
        for one in running.values():
            one.process.kill()


def one(task: Task, work: Callable[..., Any], advice: str = "") -> Result:
    """The result of a single task."""
    ((_, result),) = run([task], work, 1, advice)
    return result


def _received(end: Connection, one: _Running, advice: str) -> Result:
    try:
        value, refused = json.loads(end.recv_bytes(MAX_ANSWER_BYTES))
        result = Result(value, refused)
    except (EOFError, OSError, ValueError):
        one.process.join(5)
        text = _death(one.process.exitcode, one.task.bounds)
        result = Result(None, _advised(one.task, text, advice), died=True)
    end.close()
    one.process.join(5)
    if one.process.is_alive():
        one.process.kill()
        one.process.join()
    return result


def _advised(task: Task, text: str, advice: str) -> str:
    return f"{task.name}: {text}" + (f"; {advice}" if advice else "")


def _death(code: int | None, bounds: Bounds) -> str:
    if code in (-signal.SIGXCPU, -signal.SIGKILL):
        return f"not done after {bounds.cpu_s:.0f} s of processor time"
    return f"its process failed (exit {code})"


def _child(end: Connection, work: Callable[..., Any], task: Task, advice: str) -> None:
    """In the process of a task: do the work within bounds, and send the result."""
    # Ctrl-C is handled by the parent, which then ends this process
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    limit(task.bounds)
    # libraries print their progress and tracebacks; only the parent writes the command's output
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    value: Any = None
    try:
        value, refused = json.dumps(work(*task.arguments)), ""
    except InhabitError as error:
        refused = one_line(error, 2000)
    except MemoryError:
        text = f"needs more than {task.bounds.memory_bytes / 2**30:.2g} GiB"
        refused = _advised(task, text, advice)
    except Exception as error:
        refused = f"{task.name}: {type(error).__name__}: {one_line(error)}"
    answer = f"[{value or 'null'}, {json.dumps(refused)}]"
    # a stopped parent has closed the connection
    with contextlib.suppress(OSError):
        end.send_bytes(answer.encode())


def limit(bounds: Bounds) -> None:
    """Apply the bounds to this process."""
    cpu_s = max(1, round(bounds.cpu_s))
    resource.setrlimit(resource.RLIMIT_CPU, (cpu_s, cpu_s + 5))
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + bounds.memory_bytes
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

"""Standard output and standard error: widths, progress, signs of life, and Ctrl-C."""

import contextlib
import itertools
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import IO, Any

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn
from rich.text import Text

from console import standby

FILE_WIDTH = 150
#: Width from which there is room for a bar beside the figures of progress.
WIDE = 80
#: Silence after which a command says what it does, s: on a terminal, where the line is replaced,
#: and in a file or pipe, where one follows another. Half of the 2 s that are promised: imports of
#: libraries keep the thread that writes waiting, on a busy machine for the better part of 1 s.
SILENCE_S = 1.0
_TICK_S = 0.1
_STANDBY_AFTER_S = 0.3
_STAT = Path("/proc/self/stat")
#: Time after Ctrl-C in which a command leaves, s.
LEAVE_S = 4.0
INTERRUPTED = 130


def age_s() -> float:
    """Return the time since this process began, s: imports that precede a command are silent. Where
    the system does not tell it, the processor time."""
    try:
        began_ticks = int(_STAT.read_text().rpartition(")")[2].split()[19])
        began_s = began_ticks / os.sysconf("SC_CLK_TCK")
        return max(0.0, time.clock_gettime(time.CLOCK_BOOTTIME) - began_s)
    except (OSError, ValueError, IndexError, AttributeError):
        return time.process_time()


def plain(file: IO[str] | None = None, width: int | None = None, record: bool = False) -> Console:
    """Return a rich console that takes text as it is: names of users may hold brackets and colons,
    which rich would read as markup and emoji."""
    return Console(file=file, width=width, record=record, markup=False, emoji=False)


def screen() -> Console:
    """Return such a console on standard output."""
    console = plain()
    return console if console.is_terminal else plain(width=FILE_WIDTH)


def note(line: str) -> None:
    """Write a line on standard error, where results are not mixed with it; an empty one is none."""
    if line:
        print(f"note: {line}", file=sys.stderr, flush=True)


def counted(count: int, noun: str) -> str:
    """Return a count and what is counted: "1 piece", "2 pieces"."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


@dataclass
class Work:
    """Work of known size: its unit, how much is done, and since when."""

    unit: str
    total: float
    began: float
    done: float = 0.0

    def text(self, now: float) -> str:
        """Return how much is done, and the time that the rest takes at the mean rate so far."""
        return f"{self.unit} {self.done:.0f} of {self.total:.0f}, to go {self.remaining(now)}"

    def remaining(self, now: float) -> str:
        """Return the remaining time as 2:03; '-' before any work is done."""
        if self.done <= 0.0:
            return "-"
        seconds = (now - self.began) * max(0.0, self.total - self.done) / self.done
        return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"


_works: list[Work] = []
_stages: list[Callable[[], str]] = []


@contextmanager
def doing(stage: str | Callable[[], str]) -> Iterator[None]:
    """Name what the command does within: signs of life say it where nothing else is counted.

    stage: "reading clips", or what returns such words at the time.
    """
    told = stage if callable(stage) else lambda: stage
    _stages.append(told)
    try:
        yield
    finally:
        _stages.remove(told)


@contextmanager
def progress(
    unit: str, total: float, stage: str | Callable[[], str] = ""
) -> Iterator[Callable[[float], None]]:
    """Show the progress of work on a terminal; yield a function that takes what is done so far.

    Elsewhere the lines of `signs_of_life` tell it. stage: what the command does, as of `doing`.
    """
    output, work = screen(), Work(unit, total, time.monotonic())
    told = TextColumn("{task.description}"), _Remaining(work)
    columns = told if output.width < WIDE else (told[0], BarColumn(), told[1])
    _works.append(work)
    try:
        shown = Progress(
            *columns, console=output, transient=True, disable=not output.is_terminal
        )  # fmt: skip
        with doing(stage) if stage else contextlib.nullcontext(), shown as bar:
            row = bar.add_task(unit, total=total)

            def update(done: float) -> None:
                work.done = done
                bar.update(row, completed=done)

            yield update
    finally:
        _works.remove(work)


class _Remaining(ProgressColumn):
    """How much is done, and the time left by the work done."""

    def __init__(self, work: Work) -> None:
        super().__init__()
        self._work = work

    def render(self, task: Task) -> Text:
        return Text(self._work.text(time.monotonic()).removeprefix(f"{self._work.unit} "))


class Watch:
    """When something was last written, and what is to be said of the silence since.

    now: a clock, s.
    """

    def __init__(self, name: str, now: float) -> None:
        self._name = name
        self._began = self._last = self._said = now

    def written(self, now: float) -> None:
        """Note that the command wrote something."""
        self._last = now

    def due(self, now: float) -> str | None:
        """Return the line to write now; None while there is nothing to say.

        It states the stage, the seconds so far, and of counted work how much is done and the time
        that the rest takes.
        """
        if now - max(self._last, self._said) < SILENCE_S:
            return None
        self._said = now
        head, tail = self._parts(now)
        return f"{head}, {now - self._began:.0f} s{tail}"

    def told(self, now: float) -> bytes:
        """Return the line as the process on standby is told it."""
        return standby.told(max(self._last, self._said), self._began, *self._parts(now))

    def _parts(self, now: float) -> tuple[str, str]:
        """Return what a line says before and after the seconds so far."""
        # the command may end one meanwhile; what is done to the end is no more what it does
        stages, works = list(_stages), [work for work in list(_works) if work.done < work.total]
        stage = stages[-1]() if stages else "working"
        return f"{self._name}: {stage}", f", {works[-1].text(now)}" if works else ""


class _Standby:
    """The process that speaks while a library holds the interpreter; see `standby`."""

    def __init__(self, terminal: bool) -> None:
        words = (str(SILENCE_S), str(standby.HELD_S), "terminal" if terminal else "file")
        try:
            self._process: subprocess.Popen[bytes] | None = subprocess.Popen(
                [sys.executable, "-I", "-S", standby.__file__, *words],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                process_group=0,  # Ctrl-C is the command's, from the first moment on
            )
        except OSError:
            self._process = None  # signs of life come when the interpreter is free
            return
        assert self._process.stdin is not None
        os.set_blocking(self._process.stdin.fileno(), False)

    def tell(self, line: bytes) -> None:
        """Tell the line of now."""
        if self._process is None or self._process.stdin is None:
            return
        # a full pipe, or a process that has ended
        with contextlib.suppress(OSError):
            os.write(self._process.stdin.fileno(), line)

    def close(self) -> None:
        """End the process."""
        if self._process is None or self._process.stdin is None:
            return
        self._process.kill()
        self._process.wait()
        self._process.stdin.close()


@contextmanager
def signs_of_life(name: str, serves: bool = False, silent_s: float = 0.0) -> Iterator[None]:
    """Say on standard error what the command does, before it was silent for 2 s.

    On a terminal this is one line that the next output replaces. Elsewhere each is a line that
    begins with the command's name ("inhabit train: "), as no error does ("inhabit: "); an error is
    the last line. serves: once the command wrote something it waits for others, and its silence
    means nothing. silent_s: seconds of silence before.
    """
    stream, lock, ended = sys.stderr, threading.Lock(), threading.Event()
    terminal = stream.isatty()
    watch = Watch(name, time.monotonic() - silent_s)
    shown = False

    def clear() -> None:
        nonlocal shown
        if shown:
            _raw("\r\x1b[K")
            shown = False

    def watched(write: Callable[[str], int]) -> Callable[[str], int]:
        def wrapped(text: str) -> int:
            if text:
                with lock:
                    clear()
                    watch.written(time.monotonic())
                    if serves:
                        ended.set()
            return write(text)

        return wrapped

    def work() -> None:
        nonlocal shown
        # a shorter command needs none
        if ended.wait(_STANDBY_AFTER_S):
            return
        other, before = _Standby(terminal), time.monotonic()
        while not ended.wait(_TICK_S):
            with lock:
                now = time.monotonic()
                # the process on standby may have written in between
                shown = shown or (terminal and now - before > standby.HELD_S)
                line, before = watch.due(now), now
                # first: a library may hold the interpreter from the next write on
                other.tell(watch.told(now))
                if line is not None:
                    _raw(f"\r\x1b[K{fitted(line)}" if terminal else f"{line}\n")
                    shown = terminal
        other.close()

    streams: list[Any] = [sys.stdout, sys.stderr]
    for one in streams:
        one.write = watched(one.write)
    thread = threading.Thread(target=work, name="signs of life", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        clear()
        for one in streams:
            del one.write


def fitted(line: str, width: int | None = None) -> str:
    """Return a line of a sign of life that fits one row of the terminal, which alone can be
    replaced: without the command's name, then without its first words."""
    room = (width or shutil.get_terminal_size().columns) - 1
    if len(line) <= room:
        return line
    words = line.partition(": ")[2].split()
    while len(words) > 1 and len(" ".join(words)) > room:
        words.pop(0)
    return " ".join(words)[:room]


def _raw(text: str) -> None:
    """Write to standard error, past its buffer."""
    try:
        os.write(2, text.encode())
    except OSError:
        return  # nobody reads it


def leave_soon() -> None:
    """End the process after LEAVE_S, whatever it waits for then."""
    timer = threading.Timer(LEAVE_S, os._exit, (INTERRUPTED,))
    timer.daemon = True
    timer.start()


@contextmanager
def answering() -> Iterator[None]:
    """Answer the first Ctrl-C at once and leave within LEAVE_S; the second leaves at once.

    Commands with handlers of their own set them within.
    """
    pressed = itertools.count()

    def handle(_number: int, _frame: FrameType | None) -> None:
        if next(pressed):
            os._exit(INTERRUPTED)
        _raw("\ninhabit: stopping\n")
        leave_soon()
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, handle)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)

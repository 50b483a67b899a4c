"""Display of a training: one live block on a terminal, plain lines elsewhere."""

import time
from collections.abc import Mapping, Sequence
from typing import Any, Protocol, Self

from rich.console import Console
from rich.live import Live

from console.run.stages import Stage
from console.terminal import plain
from console.training.block import Block, plain_line
from console.training.goal import Goal, progress, remaining, stage

PLAIN_EVERY_S = 10.0


class Display(Protocol):
    """Shows the metrics of each iteration, and notes of one line in between."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *exc: Any) -> None: ...

    def show(self, metrics: Mapping[str, float]) -> None: ...

    def stage(self) -> str: ...

    def note(self, line: str) -> None: ...


class LiveDisplay:
    """One block that is redrawn in place."""

    def __init__(
        self, title: str, goal: Goal, console: Console, stages: Sequence[Stage] = ()
    ) -> None:
        self._title, self._goal, self._console, self._stages = title, goal, console, stages
        self._live = Live(console=console, refresh_per_second=2, transient=False)
        self._since: tuple[float, float] | None = None
        self._metrics: Mapping[str, float] = {}
        self._eta = "-"

    def __enter__(self) -> Self:
        self._live.__enter__()
        return self

    def __exit__(self, *exc: Any) -> None:
        self._live.__exit__(*exc)

    def show(self, metrics: Mapping[str, float]) -> None:
        if self._since is None:
            self._goal = self._goal.after(metrics.get("seconds", 0.0))
            self._since = (progress(self._goal, metrics), metrics.get("seconds", 0.0))
        self._metrics, self._eta = metrics, remaining(self._goal, metrics, self._since)
        self._live.update(Block(self._title, self._goal, metrics, self._eta, self._stages))

    def stage(self) -> str:
        return stage(self._goal, self._metrics, self._eta)

    def note(self, line: str) -> None:
        self._console.print(line, highlight=False, markup=False)


class PlainDisplay:
    """Prints a line every few seconds, for logs and pipes."""

    def __init__(
        self, title: str, goal: Goal, console: Console, stages: Sequence[Stage] = ()
    ) -> None:
        self._title, self._goal, self._console, self._stages = title, goal, console, stages
        self._since: tuple[float, float] | None = None
        self._shown = -PLAIN_EVERY_S
        self._metrics: Mapping[str, float] = {}
        self._eta = "-"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: Any) -> None:
        return None

    def show(self, metrics: Mapping[str, float]) -> None:
        if self._since is None:
            self._goal = self._goal.after(metrics.get("seconds", 0.0))
            self._since = (progress(self._goal, metrics), metrics.get("seconds", 0.0))
        self._metrics, self._eta = metrics, remaining(self._goal, metrics, self._since)
        now = time.monotonic()
        if now - self._shown < PLAIN_EVERY_S and progress(self._goal, metrics) < 1.0:
            return
        self._shown = now
        self.note(plain_line(self._goal, metrics, self._eta, self._stages))

    def stage(self) -> str:
        return stage(self._goal, self._metrics, self._eta)

    def note(self, line: str) -> None:
        self._console.print(line, highlight=False, markup=False, soft_wrap=True)
        self._console.file.flush()


def open_display(
    title: str, goal: Goal, console: Console | None = None, stages: Sequence[Stage] = ()
) -> Display:
    """Return a live display on a terminal, a plain one elsewhere. stages: of the recipe."""
    console = console or plain()
    if console.is_terminal:
        return LiveDisplay(title, goal, console, stages)
    return PlainDisplay(title, goal, console, stages)

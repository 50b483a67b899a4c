"""Display of a training: one live block on a terminal, plain lines elsewhere."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol, Self

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from console.terminal import plain

PLAIN_EVERY_S = 10.0


@dataclass(frozen=True)
class Goal:
    """Limits of a training, of which the first ends it; None: no limit."""

    iterations: int | None = None
    samples: int | None = None
    seconds: float | None = None
    """Wall time of this process, s; the seconds of a resumed run come on top."""

    def after(self, seconds: float) -> "Goal":
        """Return the same goal for a run whose metrics already count `seconds`."""
        return replace(self, seconds=self.seconds and self.seconds + seconds)

    def fraction(self, iteration: float, samples: float, seconds: float) -> float:
        """Return the progress towards the nearest limit, 0 to 1; 0 without limits."""
        pairs = ((iteration, self.iterations), (samples, self.samples), (seconds, self.seconds))
        return min(1.0, max((done / limit for done, limit in pairs if limit), default=0.0))


class Display(Protocol):
    """Shows the metrics of each iteration, and notes of one line in between."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *exc: Any) -> None: ...

    def show(self, metrics: Mapping[str, float]) -> None: ...

    def stage(self) -> str: ...

    def note(self, line: str) -> None: ...


def stage(goal: Goal, metrics: Mapping[str, float], eta: str) -> str:
    """Return the iteration at hand and the time left, as in "iteration 12, 40 % done, to go
    1:20"."""
    words = [f"iteration {int(metrics.get('iteration', 0)) + 1}"]
    if goal != Goal():
        words += [f"{_progress(goal, metrics):.0%} done", f"to go {eta}"]
    return ", ".join(words)


def duration(seconds: float) -> str:
    """Return seconds as 1:02:03 or 2:03."""
    hours, rest = divmod(int(seconds), 3600)
    minutes, left = divmod(rest, 60)
    return f"{hours}:{minutes:02d}:{left:02d}" if hours else f"{minutes}:{left:02d}"


def remaining(goal: Goal, metrics: Mapping[str, float], since: tuple[float, float]) -> str:
    """Return the remaining time, from the progress since (fraction, seconds); '-' if unknown."""
    fraction, seconds = _progress(goal, metrics), metrics.get("seconds", 0.0)
    made, spent = fraction - since[0], seconds - since[1]
    return duration(spent * (1.0 - fraction) / made) if made > 0 and spent > 0 else "-"


def _progress(goal: Goal, metrics: Mapping[str, float]) -> float:
    return goal.fraction(*(metrics.get(k, 0.0) for k in ("iteration", "samples", "seconds")))


def _figure(metrics: Mapping[str, float], name: str, spec: str, unit: str = "") -> str:
    value = metrics.get(name)
    return "-" if value is None or value != value else f"{value:{spec}}{unit}"


def _skipped(metrics: Mapping[str, float]) -> str:
    """Return the share of the discriminator's trainings that its throttle skipped; empty for 0."""
    share = metrics.get("style/skipped", 0.0)
    return f"  skipped {share:.0%}" if share > 0 else ""


PHASES = ("world", "policy", "style", "update")


def block(title: str, goal: Goal, metrics: Mapping[str, float], eta: str) -> Group:
    """Return the live block: progress, rates, episodes, rewards, style, PPO, lags, actors."""
    samples = metrics.get("samples", 0.0)
    head = Text.assemble(
        (title, "bold"),
        f"  iteration {int(metrics.get('iteration', 0))}  {samples / 1e6:.2f} M samples  ",
        f"{duration(metrics.get('seconds', 0))}  to go {eta}",
    )
    table = Table.grid(padding=(0, 2))
    table.add_column(style="cyan", no_wrap=True)
    table.add_column()
    split = "  ".join(f"{p} {_figure(metrics, f'rate/{p}_s', '.3f', ' s')}" for p in PHASES)
    table.add_row("rate", f"{_figure(metrics, 'rate/samples_per_s', ',.0f')} samples/s   {split}")
    table.add_row(
        "episode",
        f"return {_figure(metrics, 'episode/return', '.2f')}  length "
        f"{_figure(metrics, 'episode/length', '.0f')}  success "
        f"{_figure(metrics, 'episode/success', '.1%')}  fall "
        f"{_figure(metrics, 'episode/fall', '.1%')}",
    )
    terms = sorted(k for k in metrics if k.startswith("reward/"))
    terms.sort(key=lambda k: k not in ("reward/task", "reward/style"))
    table.add_row("reward", "  ".join(f"{k[7:]} {_figure(metrics, k, '.3f')}" for k in terms))
    table.add_row(
        "style",
        f"accuracy on mocap {_figure(metrics, 'style/accuracy_mocap', '.1%')}  on policy "
        f"{_figure(metrics, 'style/accuracy_policy', '.1%')}  loss "
        f"{_figure(metrics, 'style/loss', '.3f')}  penalty "
        f"{_figure(metrics, 'style/penalty', '.3f')}{_skipped(metrics)}",
    )
    table.add_row(
        "ppo",
        f"KL {_figure(metrics, 'ppo/kl', '.4f')}  clipped "
        f"{_figure(metrics, 'ppo/clip_fraction', '.1%')}  value explained "
        f"{_figure(metrics, 'ppo/value_explained', '.2f')}",
    )
    table.add_row(
        "fleet",
        f"actors alive {_figure(metrics, 'actors/alive', '.0f')}  lag policy "
        f"{_figure(metrics, 'lag/policy', '.0f')} style {_figure(metrics, 'lag/style', '.0f')}  "
        f"dropped {_figure(metrics, 'dropped/samples', '.0f')}",
    )
    bar = Table.grid(expand=True)  # a bar alone ends no line: the next row would stand behind it
    bar.add_row(ProgressBar(total=1.0, completed=_progress(goal, metrics)))
    return Group(head, bar, table)


class LiveDisplay:
    """One block that is redrawn in place."""

    def __init__(self, title: str, goal: Goal, console: Console) -> None:
        self._title, self._goal, self._console = title, goal, console
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
            self._since = (_progress(self._goal, metrics), metrics.get("seconds", 0.0))
        self._metrics, self._eta = metrics, remaining(self._goal, metrics, self._since)
        self._live.update(block(self._title, self._goal, metrics, self._eta))

    def stage(self) -> str:
        return stage(self._goal, self._metrics, self._eta)

    def note(self, line: str) -> None:
        self._console.print(line, highlight=False, markup=False)


class PlainDisplay:
    """Prints a line every few seconds, for logs and pipes."""

    def __init__(self, title: str, goal: Goal, console: Console) -> None:
        self._title, self._goal, self._console = title, goal, console
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
            self._since = (_progress(self._goal, metrics), metrics.get("seconds", 0.0))
        self._metrics, self._eta = metrics, remaining(self._goal, metrics, self._since)
        now = time.monotonic()
        if now - self._shown < PLAIN_EVERY_S and _progress(self._goal, metrics) < 1.0:
            return
        self._shown = now
        self.note(plain_line(self._goal, metrics, self._eta))

    def stage(self) -> str:
        return stage(self._goal, self._metrics, self._eta)

    def note(self, line: str) -> None:
        self._console.print(line, highlight=False, markup=False, soft_wrap=True)
        self._console.file.flush()


def plain_line(goal: Goal, metrics: Mapping[str, float], eta: str) -> str:
    """Return the main figures of the block on one line."""
    figures = [
        f"{int(metrics.get('iteration', 0)):6d}",
        f"{metrics.get('samples', 0.0) / 1e6:8.3f} M",
        f"{_figure(metrics, 'rate/samples_per_s', ',.0f')}/s",
        f"to go {eta}",
        f"return {_figure(metrics, 'episode/return', '.2f')}",
        f"length {_figure(metrics, 'episode/length', '.0f')}",
        f"success {_figure(metrics, 'episode/success', '.1%')}",
        f"fall {_figure(metrics, 'episode/fall', '.1%')}",
        f"task {_figure(metrics, 'reward/task', '.3f')}",
        f"style {_figure(metrics, 'reward/style', '.3f')}",
        f"D mocap {_figure(metrics, 'style/accuracy_mocap', '.1%')}"
        f" policy {_figure(metrics, 'style/accuracy_policy', '.1%')}{_skipped(metrics)}",
        f"KL {_figure(metrics, 'ppo/kl', '.4f')}",
        f"explained {_figure(metrics, 'ppo/value_explained', '.2f')}",
    ]
    return "  ".join(figures)


def open_display(title: str, goal: Goal, console: Console | None = None) -> Display:
    """Return a live display on a terminal, a plain one elsewhere."""
    console = console or plain()
    if console.is_terminal:
        return LiveDisplay(title, goal, console)
    return PlainDisplay(title, goal, console)

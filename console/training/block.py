"""The figures of a training as a block of rows, as wide and as high as the screen, or as one line.

Figures are items that are never broken: a row that is too long goes on in the next line. On a low
screen the rows that matter least are left out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rich.console import Console, ConsoleOptions, RenderResult
from rich.text import Text

from console.run.stages import Stage
from console.training.goal import Goal, duration, progress

#: Width from which the labels have a column of their own; its width, and the gap between items.
_WIDE, _LABEL, _GAP = 60, 15, "  "
_PHASES = {"world": "simulator", "policy": "policy", "style": "style", "update": "update"}

Metrics = Mapping[str, float]


@dataclass(frozen=True)
class Row:
    """One row: a label, and figures that are not broken."""

    label: str
    items: Sequence[str]
    rank: int
    """Rows of the highest rank are left out first where the screen is too low."""

    def lines(self, width: int) -> list[str]:
        """Return the row in lines of at most `width` characters, where its items allow it."""
        wide = width >= _WIDE
        start = f"{self.label:{_LABEL}}" if wide else f"{self.label}: "
        indent = " " * (_LABEL if wide else 2)
        lines, empty = [start], True
        for item in self.items:
            gap = "" if empty else _GAP
            if not empty and len(lines[-1]) + len(gap) + len(item) > width:
                lines.append(indent)
                gap = ""
            lines[-1] += gap + item
            empty = False
        return lines


@dataclass(frozen=True)
class Block:
    """The live block of a training."""

    title: str
    goal: Goal
    metrics: Metrics
    eta: str
    stages: Sequence[Stage] = ()

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        width = options.max_width
        yield Text(self.title, style="bold", overflow="fold")
        if self.goal != Goal():
            yield Text(bar(progress(self.goal, self.metrics), width), no_wrap=True)
        for row in fitting(self.rows(), width, console.height - 3 - len(self.title) // width):
            for number, line in enumerate(row.lines(width)):
                text = Text(line, no_wrap=True, overflow="ignore")
                if not number:
                    text.stylize("cyan", 0, len(row.label))
                yield text

    def rows(self) -> list[Row]:
        """Return all rows, in their order."""
        metrics = self.metrics
        return [
            Row("progress", _progress(self.goal, metrics, self.eta), 0),
            *_stage(metrics, self.stages),
            Row("success", _by_start(metrics, "success", _wanted(metrics, self.stages)), 1),
            Row("fall", _by_start(metrics, "fall"), 4),
            *_reached(metrics),
            Row("episode", _episode(metrics), 5),
            Row("reward", _rewards(metrics), 7),
            Row("discriminator", discriminator(metrics), 3),
            Row("PPO", _ppo(metrics), 8),
            Row("time", _times(metrics), 9),
            Row("actors", _actors(metrics), 10),
        ]


def fitting(rows: Sequence[Row], width: int, height: int) -> list[Row]:
    """Return the rows that fit a screen: those of the highest rank are left out first."""
    found = list(rows)
    while len(found) > 1 and sum(len(row.lines(width)) for row in found) > height:
        found.remove(max(found, key=lambda row: row.rank))
    return found


def plain_line(goal: Goal, metrics: Metrics, eta: str, stages: Sequence[Stage] = ()) -> str:
    """Return the main figures of the block in one line, for logs and pipes."""
    number = int(metrics.get("recipe/stage", 0))
    items = [
        f"iteration {int(metrics.get('iteration', 0))}",
        f"{count(metrics.get('samples', 0.0))} samples",
        f"{figure(metrics, 'rate/samples_per_s', ',.0f')} samples/s",
        f"to go {eta}",
        *([f"stage {number} of {len(stages)}"] if number and stages else []),
        "success " + " ".join(_by_start(metrics, "success", _wanted(metrics, stages))),
        f"fall {figure(metrics, 'episode/fall', '.1%')}",
        *_episode(metrics),
        f"task {figure(metrics, 'reward/task', '.3f')}",
        f"style {figure(metrics, 'reward/style', '.3f')}",
        "discriminator " + ", ".join(discriminator(metrics)[:4]),
        f"KL {figure(metrics, 'ppo/kl', '.4f')}",
    ]
    return _GAP.join(items)


def bar(share: float, width: int) -> str:
    """Return a bar of characters that every terminal has, `share` of it full."""
    full = int(share * (width - 2))
    return f"[{'#' * full:.<{width - 2}}]"


def figure(metrics: Metrics, name: str, spec: str, unit: str = "") -> str:
    """Return a figure as text; '-' where there is none yet."""
    value = metrics.get(name)
    if value is None or value != value:
        return "-"
    text = f"{value:{spec}}"
    return (text if text.strip("-0.,%") else text.removeprefix("-")) + unit  # no -0.000


def count(number: float) -> str:
    """Return a number of samples as 15,360 or 1.92 M."""
    return f"{number:,.0f}" if number < 1e6 else f"{number / 1e6:.2f} M"


def discriminator(metrics: Metrics) -> list[str]:
    """Return what the discriminator thinks of mocap and of the policy, and whether it is held
    back."""
    skipped = metrics.get("style/skipped", 0.0)
    return [
        f"right on mocap {figure(metrics, 'style/accuracy_mocap', '.1%')}",
        f"right on policy {figure(metrics, 'style/accuracy_policy', '.1%')}",
        f"logit gap {figure(metrics, 'style/logit_gap', '.2f')}",
        f"throttled: {skipped:.0%} skipped" if skipped > 0 else "not throttled",
        f"loss {figure(metrics, 'style/loss', '.3f')}",
        f"penalty {figure(metrics, 'style/penalty', '.3f')}",
    ]


def _progress(goal: Goal, metrics: Metrics, eta: str) -> list[str]:
    ends = goal != Goal()
    return [
        *([f"{progress(goal, metrics):.0%} done", f"to go {eta}"] if ends else []),
        f"{figure(metrics, 'rate/samples_per_s', ',.0f')} samples/s",
        f"{count(metrics.get('samples', 0.0))} samples",
        f"iteration {int(metrics.get('iteration', 0))}",
        f"{duration(metrics.get('seconds', 0.0))} so far",
        *([] if ends else ["until Ctrl-C"]),
    ]


def _stage(metrics: Metrics, stages: Sequence[Stage]) -> list[Row]:
    """Return the row of the recipe's stage; none without a recipe."""
    number = int(metrics.get("recipe/stage", 0))
    if not 1 <= number <= len(stages):
        return []
    here, unmet = stages[number - 1], int(metrics.get("recipe/unmet", 0))
    so_far = count(metrics.get("recipe/samples", 0.0))
    items = [
        f"{number} of {len(stages)}",
        here.name,
        f"{so_far} of at most {count(here.limit)} samples",
        *([f"{unmet} before it not met"] if unmet else []),
    ]
    return [Row("stage", items, 2)]


def _wanted(metrics: Metrics, stages: Sequence[Stage]) -> Mapping[str, float]:
    """Return the success by kind of start at which the present stage ends."""
    number = int(metrics.get("recipe/stage", 0))
    return stages[number - 1].success if 1 <= number <= len(stages) else {}


def _by_start(metrics: Metrics, name: str, wanted: Mapping[str, float] | None = None) -> list[str]:
    """Return a share of episodes, of all and by kind of start; wanted: at which the stage ends."""
    prefix = f"episode/{name}_"
    kinds = [key.removeprefix(prefix) for key in metrics if key.startswith(prefix)]
    found = [("all", f"episode/{name}"), *((kind, prefix + kind) for kind in kinds)]
    return [
        f"{kind} {figure(metrics, key, '.1%')}"
        + (f" (wanted {wanted[kind]:.0%})" if wanted and kind in wanted else "")
        for kind, key in found
    ]


def _reached(metrics: Metrics) -> list[Row]:
    """Return the row of the stages of the task that episodes reach; none where it has none."""
    prefix = "episode/stage_"
    names = [key for key in metrics if key.startswith(prefix)]
    items = [f"{n.removeprefix(prefix).replace('_', ' ')} {metrics[n]:.1%}" for n in names]
    return [Row("reached", items, 6)] if items else []


def _episode(metrics: Metrics) -> list[str]:
    return [
        f"return {figure(metrics, 'episode/return', '.2f')}",
        f"length {figure(metrics, 'episode/length', '.0f')} steps",
    ]


def _rewards(metrics: Metrics) -> list[str]:
    terms = sorted(key for key in metrics if key.startswith("reward/"))
    terms.sort(key=lambda key: key not in ("reward/task", "reward/style"))
    return [f"{k[7:].replace('_', ' ')} {figure(metrics, k, '.3f')}" for k in terms]


def _ppo(metrics: Metrics) -> list[str]:
    return [
        f"KL {figure(metrics, 'ppo/kl', '.4f')}",
        f"clipped {figure(metrics, 'ppo/clip_fraction', '.1%')}",
        f"value explained {figure(metrics, 'ppo/value_explained', '.2f')}",
    ]


def _times(metrics: Metrics) -> list[str]:
    each = [f"{told} {figure(metrics, f'rate/{p}_s', '.3f', ' s')}" for p, told in _PHASES.items()]
    return [*each, f"of {figure(metrics, 'rate/iteration_s', '.3f', ' s')}"]


def _actors(metrics: Metrics) -> list[str]:
    return [
        f"{figure(metrics, 'actors/alive', '.0f')} alive",
        f"policy lag {figure(metrics, 'lag/policy', '.0f')}",
        f"style lag {figure(metrics, 'lag/style', '.0f')}",
        f"{figure(metrics, 'dropped/samples', ',.0f')} samples dropped",
    ]

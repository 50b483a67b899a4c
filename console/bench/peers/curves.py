"""Curves of `inhabit bench learning`: what control steps and episodes earned, by samples."""

import statistics
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

#: A curve has the first of these numbers of windows whose windows hold an iteration each. All are
#: multiples of ten: the marks are ends of windows.
WINDOWS = (40, 20, 10)


@dataclass(frozen=True)
class Window:
    """What the scenes counted while a library trained on some samples; sums over all scenes."""

    samples: int
    """Samples that the library had trained on at the end of the window, since its beginning."""
    control_steps: int
    reward: float
    """Task reward of these control steps."""
    episodes: int
    """Episodes that ended in the window."""
    returns: float
    """Their undiscounted returns."""
    falls: int
    """Of these episodes: those that ended in a fall."""
    seconds: float
    """Wall time, s."""

    @property
    def mean_return(self) -> float | None:
        """Mean undiscounted return of the episodes that ended; None without any."""
        return self.returns / self.episodes if self.episodes else None

    @property
    def reward_per_step(self) -> float | None:
        """Mean task reward of a control step; None without any."""
        return self.reward / self.control_steps if self.control_steps else None

    @property
    def falls_ratio(self) -> float | None:
        """Share of the episodes that ended in a fall; None without any."""
        return self.falls / self.episodes if self.episodes else None


#: Figures of a window, by the end of their name.
MEASURES = {
    "return": "mean_return",
    "reward_per_step": "reward_per_step",
    "falls_ratio": "falls_ratio",
}


@dataclass(frozen=True)
class Run:
    """The curve of one training."""

    name: str
    """Library, as in `--only`."""
    seed: int
    version: str
    """Version of the library."""
    windows: tuple[Window, ...]

    def at(self, mark: int) -> Window | None:
        """Return the window that ends at a number of samples; None beyond the curve."""
        return next((window for window in self.windows if window.samples >= mark), None)

    @property
    def rate(self) -> float:
        """Samples per second after the first window, in which scenes are built."""
        first, *others = self.windows
        return (others[-1].samples - first.samples) / sum(window.seconds for window in others)

    def to_json(self) -> dict[str, Any]:
        """Return the run as JSON values."""
        return {**asdict(self), "windows": [asdict(window) for window in self.windows]}

    @staticmethod
    def from_json(value: Mapping[str, Any]) -> "Run":
        """Return the run of JSON values; KeyError, TypeError or ValueError where it is none."""
        windows = tuple(Window(**window) for window in value["windows"])
        return Run(str(value["name"]), int(value["seed"]), str(value["version"]), windows)


def marks(samples: int) -> tuple[int, int, int]:
    """Return the numbers of samples at which returns are compared: a fifth, half and all."""
    return samples // 5, samples // 2, samples


def ends(samples: int, batch: int) -> list[int]:
    """Return the numbers of samples at which the windows of a curve end; they hold the marks.

    Empty where even the fewest windows do not hold an iteration of `batch` samples each.
    """
    count = next((count for count in WINDOWS if samples >= count * batch), 0)
    return [samples * (k + 1) // count for k in range(count)]


def figures_of(runs: Iterable[Run], samples: int) -> dict[str, float]:
    """Return the figures of runs at the marks: means over the seeds, with the least and greatest.

    A figure that a seed lacks is left out.
    """
    by_name: dict[str, list[Run]] = {}
    for run in runs:
        by_name.setdefault(run.name, []).append(run)
    found: dict[str, float] = {}
    for name, of_seeds in by_name.items():
        for mark in marks(samples):
            for end, measure in MEASURES.items():
                values = [getattr(run.at(mark), measure, None) for run in of_seeds]
                found |= _spread(f"{name}_at_{mark}_{end}", values)
    return found


def _spread(name: str, values: Sequence[float | None]) -> dict[str, float]:
    known = [value for value in values if value is not None]
    if len(known) < len(values):
        return {}
    low, high = min(known), max(known)
    return {name: statistics.fmean(known), f"{name}_least": low, f"{name}_greatest": high}

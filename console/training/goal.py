"""Limits of a training: the progress towards them, and the time left."""

from collections.abc import Mapping
from dataclasses import dataclass, replace


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


def stage(goal: Goal, metrics: Mapping[str, float], eta: str) -> str:
    """Return the iteration at hand and the time left, as in "iteration 12, 40 % done, to go
    1:20"."""
    words = [f"iteration {int(metrics.get('iteration', 0)) + 1}"]
    if goal != Goal():
        words += [f"{progress(goal, metrics):.0%} done", f"to go {eta}"]
    return ", ".join(words)


def duration(seconds: float) -> str:
    """Return seconds as 1:02:03 or 2:03."""
    hours, rest = divmod(int(seconds), 3600)
    minutes, left = divmod(rest, 60)
    return f"{hours}:{minutes:02d}:{left:02d}" if hours else f"{minutes}:{left:02d}"


def remaining(goal: Goal, metrics: Mapping[str, float], since: tuple[float, float]) -> str:
    """Return the remaining time, from the progress since (fraction, seconds); '-' if unknown."""
    fraction, seconds = progress(goal, metrics), metrics.get("seconds", 0.0)
    made, spent = fraction - since[0], seconds - since[1]
    return duration(spent * (1.0 - fraction) / made) if made > 0 and spent > 0 else "-"


def progress(goal: Goal, metrics: Mapping[str, float]) -> float:
    return goal.fraction(*(metrics.get(k, 0.0) for k in ("iteration", "samples", "seconds")))

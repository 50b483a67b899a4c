"""The end of a stage of training: a condition on measured success, or a limit of samples."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Outcome = Literal["", "met", "limit"]
"""Of a stage: it goes on, its condition holds, or its samples are used up."""
ALL = "all"


@dataclass(frozen=True)
class StageEnd:
    """When a stage ends."""

    number: int = 1
    """Number of the stage, from 1."""
    success: Mapping[str, float] = field(default_factory=dict)
    """Least success rate by category of initial state; ALL: of all episodes."""
    episodes: int = 2048
    """Number of last episodes that the rates are of."""
    at_least: int = 0
    """Samples of the stage before which the condition is not looked at."""
    limit: int = 0
    """Samples of the stage at which it ends in any case."""

    def measured(self, metrics: Mapping[str, float]) -> dict[str, float]:
        """Return the success rates that the condition is on, of an episode window's metrics; 0
        where no such episode has ended."""
        names = {kind: f"_{kind}" if kind != ALL else "" for kind in self.success}
        return {kind: metrics.get(f"episode/success{end}", 0.0) for kind, end in names.items()}

    def outcome(self, samples: int, ended: int, metrics: Mapping[str, float]) -> Outcome:
        """Return whether the stage has ended, after so many samples and ended episodes of it."""
        if samples >= self.at_least and ended >= self.episodes:
            found = self.measured(metrics)
            if all(found[kind] >= least for kind, least in self.success.items()):
                return "met"
        return "limit" if samples >= self.limit else ""

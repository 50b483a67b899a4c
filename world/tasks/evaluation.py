"""Evaluation settings of a task: time limit, distances, and published results to compare with."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Published:
    """A published result; None where a figure was not published."""

    name: str
    success: float | None = None
    """Per cent."""
    time_s: float | None = None
    precision_cm: float | None = None


@dataclass(frozen=True)
class Evaluation:
    """Evaluation settings; the defaults are the paper's (section 7.1)."""

    limit_s: float = 20.0
    """Time within which the target must be reached."""
    start_m: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Least and greatest initial distance by protocol (`table1`, `table3`), m, where it differs
    from the protocol's own."""
    published: Mapping[str, tuple[Published, ...]] = field(default_factory=dict)
    """Rows by protocol, the paper's own first (Tables 1 and 3; TokenHSI's specialists)."""
    perturbed: tuple[Published, ...] = ()
    """Table 2, which does not separate projectiles from moved objects."""

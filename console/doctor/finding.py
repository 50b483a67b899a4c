"""What `inhabit doctor` finds: one line a thing."""

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["ok", "mind", "bad"]


@dataclass(frozen=True)
class Finding:
    """One thing looked at: `bad` keeps training from working, `mind` costs something."""

    name: str
    verdict: Verdict
    detail: str
    slots: int | None = None
    """CPU slots of a Ray cluster that was reached."""

"""Findings of `inhabit doctor`, one line each."""

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["ok", "mind", "bad"]


@dataclass(frozen=True)
class Finding:
    """The result of one check: with `bad` training cannot work, with `mind` it is limited."""

    name: str
    verdict: Verdict
    detail: str
    slots: int | None = None
    """CPU slots of the Ray cluster, if reached."""

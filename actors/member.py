"""A member of a fleet: one Ray actor and the fleet's view of it."""

from dataclasses import dataclass
from typing import Any


@dataclass(eq=False)
class Member:
    """One actor and the fleet's view of it."""

    index: int
    handle: Any
    start_call: Any
    """Reference of the call that starts the actor; None once it has started"""
    requested_s: float
    pid: int = 0
    cost_s: float | None = None
    """Time per block of scenes, s"""
    scenes: range = range(0)
    """The actor's own part"""
    in_sync: bool = False
    """Whether the worker's state is the fleet's state of that part"""
    acting: bool = False
    """Whether the part was requested in the last collection, and the actor has not failed since"""
    superseded: Any = None
    """Reference of a call whose answer is no longer needed"""
    failures: int = 0

    @property
    def ready(self) -> bool:
        """Whether the actor has started and works at no superseded call."""
        return self.start_call is None and self.superseded is None

"""One collection: which parts were asked of whom, which are there, which are owed to nobody yet.

Parts are ranges of whole blocks; those asked for lie within one another or apart. What two actors
deliver of the same scenes has the same bits, so it does not matter whose is taken: only that each
scene is taken once.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from torch import Tensor

from actors.ray_actor import Arrays
from actors.division import within


@dataclass(eq=False)
class Job:
    """A part that an actor was asked for."""

    reference: Any
    member: Any
    scenes: range
    asked_s: float
    failures: int = 0
    """Actors in a row that failed at it"""
    helped: bool = False
    """Whether it is late, and others were given the same"""


@dataclass(frozen=True)
class Order:
    """What a collection acts with; its weights are in the object store."""

    weights: Mapping[str, Tensor]
    version: int
    sigma: float
    published: Any

    def is_of(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> bool:
        return self.weights is weights and (self.version, self.sigma) == (version, sigma)


class Collection:
    """All scenes' parts of one collection; knows no Ray."""

    def __init__(self, scenes: range, block: int, late_s: float, late_factor: float) -> None:
        self.jobs: dict[Any, Job] = {}
        """Not yet answered, by their reference"""
        self.results: dict[range, tuple[dict[str, Any], Arrays]] = {}
        """Packed rollout and state after it; no scene is in two of them"""
        self.owed: list[tuple[range, int]] = []
        """Parts to be given away, and how many actors failed at them"""
        self.sound: set[int] = set()
        """ids of the members that have answered, or started, since it began"""
        self.helped = 0
        """Parts that were late"""
        self._scenes, self._block = scenes, block
        self._late_s, self._late_factor = late_s, late_factor
        self._took: list[float] = []

    @property
    def complete(self) -> bool:
        """Whether every scene is there."""
        return sum(len(part) for part in self.results) == len(self._scenes)

    def ask(self, reference: Any, member: Any, scenes: range, failures: int = 0) -> None:
        """A part has been asked of a member."""
        self.jobs[reference] = Job(reference, member, scenes, time.monotonic(), failures)

    def take_over(self, job: Job, asked_s: float) -> None:
        """A part that a member was asked for before, and could begin with at `asked_s`."""
        job.asked_s = max(job.asked_s, asked_s)
        self.jobs[job.reference] = job

    def owe_the_rest(self) -> None:
        """Scenes that nobody was asked for are owed."""
        first = self._scenes.start
        asked = sorted((job.scenes for job in self.jobs.values()), key=lambda part: part.start)
        for part in [*asked, range(self._scenes.stop, self._scenes.stop)]:
            if first < part.start:
                self.owed.append((range(first, part.start), 0))
            first = part.stop

    def take(self, helpers: int) -> tuple[range, int]:
        """A part of what is owed for one of so many helpers; and how many failed at it."""
        scenes, failures = self.owed.pop(0)
        blocks = len(scenes) // self._block
        cut = scenes.start + -(-blocks // max(1, helpers)) * self._block
        if cut < scenes.stop:
            self.owed.insert(0, (range(cut, scenes.stop), failures))
        return range(scenes.start, min(cut, scenes.stop)), failures

    def answer(self, job: Job, packed: dict[str, Any], state: Arrays) -> bool:
        """Take what was delivered, unless it is there already; whether it was taken."""
        del self.jobs[job.reference]
        self.sound.add(id(job.member))
        self._took.append(time.monotonic() - job.asked_s)
        if any(within(job.scenes, part) for part in self.results):
            return False
        self.results = {p: r for p, r in self.results.items() if not within(p, job.scenes)}
        self.results[job.scenes] = (packed, state)
        # What is there need not be given away, though a part of it may have been.
        self.owed = [(part, n) for part, n in self.owed if not within(part, job.scenes)]
        return True

    def fail(self, job: Job) -> int:
        """A member failed: what of its part nobody else is at is owed; failures in a row."""
        del self.jobs[job.reference]
        at = [other.scenes for other in self.jobs.values() if not other.helped]
        at += [*self.results, *(part for part, _ in self.owed)]
        failures = job.failures + 1
        for first in range(job.scenes.start, job.scenes.stop, self._block):
            block = range(first, first + self._block)
            if not any(within(block, part) for part in at):
                self._owe(block, failures)
        return failures

    @property
    def late_at_s(self) -> float | None:
        """When the next one that still works will be late; None until half have answered."""
        patience, waiting = self._patience_s(), self._waiting()
        return None if patience is None else min(job.asked_s for job in waiting) + patience

    def look_for_late(self, now: float) -> None:
        """What late members were asked for is owed as well."""
        patience = self._patience_s()
        if patience is None:
            return
        for job in self._waiting():
            if now >= job.asked_s + patience:
                job.helped = True
                self.helped += 1
                self.owed.append((job.scenes, 0))

    def _waiting(self) -> list[Job]:
        return [job for job in self.jobs.values() if not job.helped]

    def _patience_s(self) -> float | None:
        waiting = len(self._waiting())
        if not waiting or len(self._took) < waiting:
            return None
        return max(self._late_s, self._late_factor * max(self._took))

    def _owe(self, block: range, failures: int) -> None:
        if self.owed and self.owed[-1][0].stop == block.start and self.owed[-1][1] == failures:
            block = range(self.owed.pop()[0].start, block.stop)
        self.owed.append((block, failures))

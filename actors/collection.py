"""State of one collection: the parts that are assigned, delivered and queued.

A part is a range of whole blocks of scenes. Two assigned parts are nested or disjoint. Two actors
that deliver the same scenes deliver the same bits, so any of their results may be used, but each
scene is used once.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from torch import Tensor

from actors.division import within
from actors.ray_actor import Arrays


@dataclass(eq=False)
class Job:
    """A part that is assigned to an actor."""

    reference: Any
    member: Any
    scenes: range
    requested_s: float
    failures: int = 0
    """Number of actors in a row that failed at this part"""
    straggling: bool = False
    """Whether the actor is a straggler and the part is queued for others as well"""


@dataclass(frozen=True)
class PublishedPolicy:
    """Policy and action noise of a collection; `published` is the weights' reference in the object
    store."""

    weights: Mapping[str, Tensor]
    version: int
    sigma: float
    published: Any

    def matches(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> bool:
        """Whether these are the arguments that it was published with."""
        return self.weights is weights and (self.version, self.sigma) == (version, sigma)


class Collection:
    """Bookkeeping of one collection over all scenes; independent of Ray."""

    def __init__(
        self, scenes: range, block: int, straggler_s: float, straggler_factor: float
    ) -> None:
        self.jobs: dict[Any, Job] = {}
        """Jobs without an answer, by reference"""
        self.results: dict[range, tuple[dict[str, Any], Arrays]] = {}
        """Packed rollout and the state after it, by part; no scene is in two parts"""
        self.queued: list[tuple[range, int]] = []
        """Parts to be assigned, and the number of actors that failed at them"""
        self.responsive: set[int] = set()
        """ids of the members that have answered or started since the collection began"""
        self.stragglers = 0
        """Number of parts whose actor was a straggler"""
        self._scenes, self._block = scenes, block
        self._straggler_s, self._straggler_factor = straggler_s, straggler_factor
        self._durations_s: list[float] = []

    @property
    def complete(self) -> bool:
        """Whether every scene is delivered."""
        return sum(len(part) for part in self.results) == len(self._scenes)

    def assign(self, reference: Any, member: Any, scenes: range, failures: int = 0) -> None:
        """Record that a part is assigned to a member."""
        self.jobs[reference] = Job(reference, member, scenes, time.monotonic(), failures)

    def adopt(self, job: Job, requested_s: float) -> None:
        """Record a prefetched part, whose member was free from `requested_s` on."""
        job.requested_s = max(job.requested_s, requested_s)
        self.jobs[job.reference] = job

    def queue_unassigned(self) -> None:
        """Queue the scenes that are not assigned."""
        first = self._scenes.start
        assigned = sorted((job.scenes for job in self.jobs.values()), key=lambda part: part.start)
        for part in [*assigned, range(self._scenes.stop, self._scenes.stop)]:
            if first < part.start:
                self.queued.append((range(first, part.start), 0))
            first = part.stop

    def next_part(self, helpers: int) -> tuple[range, int]:
        """Remove a part from the queue, sized for one of `helpers` actors.

        Returns also the number of actors that failed at it.
        """
        scenes, failures = self.queued.pop(0)
        blocks = len(scenes) // self._block
        cut = scenes.start + -(-blocks // max(1, helpers)) * self._block
        if cut < scenes.stop:
            self.queued.insert(0, (range(cut, scenes.stop), failures))
        return range(scenes.start, min(cut, scenes.stop)), failures

    def deliver(self, job: Job, packed: dict[str, Any], state: Arrays) -> bool:
        """Use a result unless its scenes are delivered already; returns whether it is used."""
        del self.jobs[job.reference]
        self.responsive.add(id(job.member))
        self._durations_s.append(time.monotonic() - job.requested_s)
        if any(within(job.scenes, part) for part in self.results):
            return False
        self.results = {p: r for p, r in self.results.items() if not within(p, job.scenes)}
        both = [p for p in self.results if p.start < job.scenes.stop and job.scenes.start < p.stop]
        assert not both, f"{job.scenes} and {both[0]} share scenes, and neither is in the other"
        self.results[job.scenes] = (packed, state)
        # Delivered scenes need no other actor; parts of them may be assigned already.
        self.queued = [(part, n) for part, n in self.queued if not within(part, job.scenes)]
        return True

    def fail(self, job: Job) -> int:
        """Queue what no other member has of a failed job; returns its failures in a row."""
        del self.jobs[job.reference]
        at = [other.scenes for other in self.jobs.values() if not other.straggling]
        at += [*self.results, *(part for part, _ in self.queued)]
        failures = job.failures + 1
        # Joined with blocks of this job alone: a part across two jobs would be in neither.
        parts: list[range] = []
        for first in range(job.scenes.start, job.scenes.stop, self._block):
            block = range(first, first + self._block)
            if any(within(block, part) for part in at):
                continue
            if parts and parts[-1].stop == first:
                block = range(parts.pop().start, block.stop)
            parts.append(block)
        self.queued += [(part, failures) for part in parts]
        return failures

    @property
    def next_straggler_s(self) -> float | None:
        """Time at which the next running job becomes a straggler; None until half have answered."""
        age_s, outstanding = self._straggler_age_s(), self._outstanding()
        return None if age_s is None else min(job.requested_s for job in outstanding) + age_s

    def queue_stragglers(self, now: float) -> None:
        """Queue the parts of stragglers for other members as well."""
        age_s = self._straggler_age_s()
        if age_s is None:
            return
        for job in self._outstanding():
            if now >= job.requested_s + age_s:
                job.straggling = True
                self.stragglers += 1
                self.queued.append((job.scenes, 0))

    def _outstanding(self) -> list[Job]:
        return [job for job in self.jobs.values() if not job.straggling]

    def _straggler_age_s(self) -> float | None:
        outstanding = len(self._outstanding())
        if not outstanding or len(self._durations_s) < outstanding:
            return None
        return max(self._straggler_s, self._straggler_factor * max(self._durations_s))

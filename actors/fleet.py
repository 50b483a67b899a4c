"""A fleet of Ray actors that yields the local fleet's numbers, also when actors die or hang.

Rollouts come back as one object-store reference an actor. Measured on two cores, two actors of 256
scenes, horizon 8 (2.8 MB in all): 7 ms an iteration so, 11 to 27 ms as streams of 2 to 8 chunks; in
lockstep nothing can start before the last chunk is there.
"""

import logging
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

import ray
from ray.exceptions import GetTimeoutError, RayActorError, RayError, RayTaskError
from torch import Tensor

from actors.local import divide, merge, split
from actors.ray_actor import (
    Arrays,
    MakeShard,
    RolloutActor,
    to_arrays,
    to_tensors,
    unpack_rollout,
)
from policy.rollout import Rollout
from world.errors import InhabitError

LOG = logging.getLogger("inhabit.actors")


class FleetError(InhabitError):
    """Actors that keep failing; the message has the last cause."""


@dataclass(frozen=True)
class FleetConfig:
    """How actors are placed, and how long they are trusted."""

    cpus_per_actor: float = 1.0
    """Ray CPU slots of an actor; it acts on one thread"""
    start_s: float = 180.0
    """Seconds that an actor may take to start and compile its scenes"""
    rollout_s: float = 120.0
    """Seconds that a rollout may take before its actor counts as hung and is replaced"""
    restarts: int = 3
    """Failures in a row of the same actor that are mended; the next one ends the run"""


@dataclass
class _Member:
    """One shard's actor of the moment, and where it stood after its last whole rollout."""

    index: int
    scenes: range
    handle: Any
    built: Any
    state: Arrays | None = None
    """None: as built"""
    failures: int = 0
    pid: int = 0


class RayFleet:
    """Actors that own all scenes between them; needs `actors.cluster.ray_session`.

    An actor that dies, or exceeds its deadline, is replaced; the replacement takes up the shard's
    state from before the rollout and collects it again, with the same weights: since all randomness
    is a function of (seed, scene, clock), the bits are those of an undisturbed run.
    """

    def __init__(
        self,
        make_shard: MakeShard,
        scenes: int,
        block: int = 64,
        workers: int = 2,
        seed: int = 0,
        horizon: int = 8,
        config: FleetConfig | None = None,
    ) -> None:
        self.config = config or FleetConfig()
        self.horizon = horizon
        self.restarts = 0
        """actors replaced so far"""
        self._make_shard, self._seed, self._block = make_shard, seed, block
        self._members: list[_Member] = []
        self._alive = workers
        # Ray restarts actors by itself only without their state: the fleet does it instead.
        self._actor: Any = ray.remote(
            num_cpus=self.config.cpus_per_actor, max_restarts=0, max_task_retries=0
        )(RolloutActor)
        try:
            for index, owned in enumerate(divide(scenes, block, workers)):
                handle, built = self._start(owned, None)
                self._members.append(_Member(index, owned, handle, built))
            for member in self._members:
                self._await_built(member)
        except BaseException:
            self.close()
            raise

    def collect(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> Rollout:
        """One rollout of all scenes, in order; FleetError if an actor fails time and again."""
        published = ray.put(to_arrays(weights))
        arguments = (published, version, self.horizon, sigma)
        waiting = {m.index: self._ask(m, arguments) for m in self._members}
        replaced: set[int] = set()
        parts: list[Rollout] = []
        while waiting:
            due = min(deadline for _, deadline in waiting.values())
            refs = {ref: index for index, (ref, _) in waiting.items()}
            ready, _ = ray.wait(list(refs), timeout=max(0.0, due - time.monotonic()))
            # Ready ones are there, or have failed; the overdue get no more time.
            patience = None if ready else 0
            for index in [refs[ref] for ref in ready] or self._overdue(waiting):
                member, (ref, _) = self._members[index], waiting[index]
                try:
                    # The build comes first: if it failed, so did the rollout, less tellingly.
                    member.pid = ray.get(member.built, timeout=patience)
                    packed, state = ray.get(ref, timeout=patience)
                except (RayError, GetTimeoutError) as error:
                    self._replace(member, explain(error, self.config.rollout_s))
                    replaced.add(index)
                    waiting[index] = self._ask(member, arguments, extra_s=self.config.start_s)
                    continue
                member.state, member.failures = state, 0
                parts.append(unpack_rollout(packed))
                del waiting[index]
        self._alive = len(self._members) - len(replaced)
        return Rollout.join(parts)

    def alive(self) -> int:
        """Actors that took part in the last collection from its start to its end."""
        return self._alive

    def pids(self) -> list[int]:
        """Process ids of the actors, in scene order."""
        return [member.pid for member in self._members]

    def state_dict(self) -> dict[str, Any]:
        """All scenes' state, as the local fleet gives it."""
        states: list[Arrays] = [
            m.state if m.state is not None else cast(Arrays, ray.get(m.handle.state.remote()))
            for m in self._members
        ]
        copies = [{k: v.clone() for k, v in to_tensors(state).items()} for state in states]
        return merge(copies, [m.scenes for m in self._members])

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Restore what either fleet's `state_dict` gave, over any number of actors."""
        parts = split(state, [m.scenes for m in self._members])
        for member, part in zip(self._members, parts, strict=True):
            member.state = to_arrays(part)
            member.built = member.handle.build.remote(member.state)
        for member in self._members:
            self._await_built(member)

    def close(self) -> None:
        """End the actors' processes."""
        for member in self._members:
            ray.kill(member.handle, no_restart=True)
        self._members = []

    def _start(self, scenes: range, state: Arrays | None) -> tuple[Any, Any]:
        handle = self._actor.remote(self._make_shard, scenes, self._seed, self._block)
        return handle, handle.build.remote(state)

    def _ask(self, member: _Member, arguments: tuple, extra_s: float = 0.0) -> tuple[Any, float]:
        reference = member.handle.rollout.remote(*arguments)
        return reference, time.monotonic() + self.config.rollout_s + extra_s

    def _overdue(self, waiting: Mapping[int, tuple[Any, float]]) -> list[int]:
        now = time.monotonic()
        return [index for index, (_, deadline) in waiting.items() if deadline <= now]

    def _await_built(self, member: _Member) -> None:
        while True:
            try:
                member.pid = ray.get(member.built, timeout=self.config.start_s)
                return
            except (RayError, GetTimeoutError) as error:
                self._replace(member, explain(error, self.config.start_s))

    def _replace(self, member: _Member, cause: str) -> None:
        """Another actor in the member's place, at the state before the rollout."""
        member.failures += 1
        name = f"actor {member.index} (scenes {member.scenes.start} to {member.scenes.stop - 1})"
        if member.failures > self.config.restarts:
            raise FleetError(f"{name} failed {member.failures} times in a row: {cause}")
        LOG.warning("%s is replaced: %s", name, cause)
        ray.kill(member.handle, no_restart=True)
        self.restarts += 1
        member.handle, member.built = self._start(member.scenes, member.state)


def explain(error: Exception, deadline_s: float) -> str:
    """What happened to an actor, in one line; what a person can act on is raised as itself."""
    if isinstance(error, GetTimeoutError):
        return f"no answer within {deadline_s:g} s (hung, or no free CPU slot to start on)"
    if isinstance(error, RayTaskError):
        if isinstance(error.cause, InhabitError):
            raise error.cause from None
        return f"{type(error.cause).__name__}: {_first_line(error.cause)}"
    if isinstance(error, RayActorError):
        return "its process died (killed, out of memory, or crashed)"
    return f"{type(error).__name__}: {_first_line(error)}"


def _first_line(error: BaseException) -> str:
    return next(iter(str(error).strip().splitlines()), "no message")

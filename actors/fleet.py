"""A fleet of Ray actors whose numbers equal the local fleet's, also when actors die, hang or lag.

A rollout is one object-store reference per actor. Measured on two cores, two actors of 256 scenes,
horizon 8 (2.8 MB in all): 7 ms per iteration, against 11 to 27 ms as streams of 2 to 8 chunks; in
lockstep the learner waits for the last chunk anyway.
"""

import logging
import threading
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, cast

import ray
from ray.exceptions import GetTimeoutError, RayError
from torch import Tensor

from actors.collection import Collection, Job, PublishedPolicy
from actors.division import block_counts, consecutive_ranges, makespan, state_of_scenes
from actors.errors import FleetError
from actors.failures import explain
from actors.local import divide, merge, split
from actors.member import Member
from actors.ray_actor import (
    Arrays,
    MakeShard,
    RolloutActor,
    to_arrays,
    to_tensors,
    unpack_rollout,
)
from policy.rollout import Abandoned, Rollout

LOG = logging.getLogger("inhabit.actors")
_COST_WEIGHT = 0.3  # weight of the newest measurement of an actor's cost
_COST_DECAY = 0.03  # fraction of its excess cost that an idle actor is forgiven per rollout
_COST_LIMIT = 20.0  # bound on the cost of an idle actor, in units of the fastest actor's
# Scenes are divided again where that is _DIVISION_GAIN times faster for _DIVISION_ROLLOUTS in a row
_DIVISION_GAIN = 1.25
_DIVISION_ROLLOUTS = 3
_LISTEN_S = 0.5  # longest wait before the fleet looks whether its collection is abandoned
_GATHER_S = 0.005  # wait for further answers after the first: each ray.wait has a fixed cost


@dataclass(frozen=True)
class FleetConfig:
    """Placement of actors, and their time-outs."""

    cpus_per_actor: float = 1.0
    """Ray CPU slots of an actor; it acts on one thread."""
    start_s: float = 180.0
    """Longest time that an actor takes to start and compile its scenes, s."""
    rollout_s: float = 120.0
    """Longest time of a rollout, s; after it the actor counts as hung and is replaced."""
    straggler_s: float = 1.0
    """Least age of a request, s, at which its actor counts as a straggler: other actors then
    collect its part too, and the first result is used."""
    straggler_factor: float = 2.0
    """Multiple of the other actors' longest time after which an actor counts as a straggler."""
    restarts: int = 3
    """Number of failures in a row after which an actor is replaced; the next one ends the run."""


class RayFleet:
    """Actors that own all scenes between them; needs `actors.cluster.ray_session`.

    If an actor dies, hangs or lags, other actors (or else its replacement) collect its part again,
    from the state before the rollout and with the same weights. All randomness is a function of
    (seed, scene, clock), so the bits equal those of an undisturbed run. A replacement joins once it
    has started. Parts are sized so that all actors end at the same time.
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
        """Actors replaced so far"""
        self.stragglers = 0
        """Parts so far that other actors collected too because their actor was a straggler"""
        self._make_shard, self._seed, self._block = make_shard, seed, block
        self._scenes = range(scenes)
        self._slow_rollouts = 0
        self._abandoned = False
        self._prefetched_policy: PublishedPolicy | None = None
        self._prefetched: list[Job] = []
        """Jobs of the next collection that are requested already"""
        self._lock = threading.Lock()
        """Held while parts are requested and while actors are replaced"""
        # Ray's own restarts lose an actor's state, so the fleet restarts actors itself.
        # Task events would keep a record of every request in the control store: 13 MB in 90 min.
        remote: Any = ray.remote  # its type stubs lack enable_task_events
        self._actor: Any = remote(
            num_cpus=self.config.cpus_per_actor,
            max_restarts=0,
            max_task_retries=0,
            enable_task_events=False,
        )(RolloutActor)
        self._members: list[Member] = []
        ranges = divide(scenes, block, workers)
        #: State of all scenes after the last rollout; empty: as built.
        self._states: dict[range, Arrays] = {owned: {} for owned in ranges}
        try:
            for index, owned in enumerate(ranges):
                member = Member(index, None, None, 0.0, scenes=owned)
                self._start(member)
                self._members.append(member)
            for member in self._members:
                self._await_started(member)
                member.in_sync = True
        except BaseException:
            self.close()
            raise
        self._before = self._states
        """State of all scenes before the last rollout"""

    def collect(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> Rollout:
        """One rollout of all scenes, in scene order.

        Raises FleetError where an actor fails more often in a row than `restarts`, and Abandoned
        after `abandon`.
        """
        self._before = self._states
        policy, prefetched = self._take_prefetched(weights, version, sigma)
        self._admit_ready()
        self._redivide()
        arguments = self._arguments(policy)
        collection = Collection(
            self._scenes, self._block, self.config.straggler_s, self.config.straggler_factor
        )
        for job in self._still_valid(prefetched):
            collection.adopt(job, job.member.requested_s)
            job.member.acting = True
        for member in self._members:
            if member.ready and member.scenes and not member.acting:
                self._assign(collection, member, member.scenes, arguments)
        collection.queue_unassigned()
        while not collection.complete:
            if self._abandoned:
                raise Abandoned
            self._assign_queued(collection, arguments)
            self._wait(collection)
        for job in collection.jobs.values():
            job.member.superseded, job.member.in_sync = job.reference, False
        self.stragglers += collection.stragglers
        self._states = {scenes: state for scenes, (_, state) in collection.results.items()}
        return Rollout.join([unpack_rollout(packed) for packed, _ in collection.results.values()])

    def abandon(self) -> None:
        """See learner.protocols.AbandoningFleet; the actors end what they work at for nobody."""
        self._abandoned = True

    def rewind(self) -> None:
        """Return all scenes to the beginning of the last collection."""
        self._states = self._before
        with self._lock:
            self._prefetched_policy, self._prefetched = None, []
        for member in self._members:
            member.in_sync = False

    def prefetch(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> None:
        """Request the next collection during the present one, with the arguments of its `collect`.

        An actor begins with it as soon as its present part is done, while the fleet still collects
        the parts of the others. No number changes. May be called from another thread than
        `collect`.
        """
        if self._prefetched_policy is not None:
            return  # one collection is prefetched already
        policy = PublishedPolicy(weights, version, sigma, ray.put(to_arrays(weights)))
        arguments = self._arguments(policy)
        with self._lock:
            self._prefetched_policy = policy
            for member in self._members:
                if member.ready and member.acting:
                    # In the actor's queue it stands behind the part whose end state it begins from.
                    reference = member.handle.part.remote(member.scenes, None, *arguments)
                    self._prefetched.append(Job(reference, member, member.scenes, time.monotonic()))

    def _arguments(self, policy: PublishedPolicy) -> tuple:
        return policy.published, policy.version, self.horizon, policy.sigma

    def _take_prefetched(
        self, weights: Mapping[str, Tensor], version: int, sigma: float
    ) -> tuple[PublishedPolicy, list[Job]]:
        """Return a collection's policy and its prefetched jobs; none where the arguments differ."""
        with self._lock:
            policy, prefetched = self._prefetched_policy, self._prefetched
            self._prefetched_policy, self._prefetched = None, []
            for member in self._members:
                member.acting = False
        if policy is not None and policy.matches(weights, version, sigma):
            return policy, prefetched
        _invalidate(prefetched)
        return PublishedPolicy(weights, version, sigma, ray.put(to_arrays(weights))), []

    def _still_valid(self, prefetched: list[Job]) -> list[Job]:
        """Return the prefetched jobs that begin from the right state, and drop the others."""
        valid = [
            job
            for job in prefetched
            if job.member.ready and job.member.in_sync and job.member.scenes == job.scenes
        ]
        _invalidate([job for job in prefetched if job not in valid])
        return valid

    def alive(self) -> int:
        """Number of actors that have started and have not failed since."""
        return sum(member.start_call is None for member in self._members)

    def pids(self) -> list[int]:
        """Process ids of the actors, each on the actor's own node."""
        return [member.pid for member in self._members]

    def division(self) -> list[int]:
        """Number of scenes of each actor; 0 for one that has not started or is too slow."""
        return [len(member.scenes) for member in self._members]

    def state_dict(self) -> dict[str, Any]:
        """State of all scenes, as the local fleet's."""
        owners = {m.scenes: m for m in self._members}
        states = {
            scenes: state or cast(Arrays, ray.get(owners[scenes].handle.state.remote()))
            for scenes, state in sorted(self._states.items(), key=lambda item: item[0].start)
        }
        copies = [{k: v.clone() for k, v in to_tensors(s).items()} for s in states.values()]
        return merge(copies, list(states))

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Restore the state of any fleet over the same scenes, for any number of actors."""
        ranges = sorted(self._states, key=lambda scenes: scenes.start)
        parts = split(state, ranges)
        with self._lock:
            _invalidate(self._prefetched)
            self._prefetched_policy, self._prefetched = None, []
        self._states = {r: to_arrays(part) for r, part in zip(ranges, parts, strict=True)}
        self._before = self._states
        for member in self._members:
            member.in_sync = False

    def close(self) -> None:
        """End the actors' processes."""
        for member in self._members:
            ray.kill(member.handle, no_restart=True)
        self._members = []

    def _start(self, member: Member) -> None:
        """Start a new actor for a member; it takes part once it has started."""
        # Without a part it builds the first block, to read its clips and compile its furniture.
        scenes = member.scenes or range(self._block)
        with self._lock:
            member.handle = self._actor.remote(self._make_shard, scenes, self._seed, self._block)
            member.start_call = member.handle.build.remote(None)
            member.requested_s = time.monotonic()
            member.cost_s, member.superseded = None, None
            member.in_sync = member.acting = False
            self._prefetched = [job for job in self._prefetched if job.member is not member]

    def _await_started(self, member: Member) -> None:
        while member.start_call is not None:
            self._started(member, self.config.start_s)

    def _started(self, member: Member, timeout: float | None = None) -> None:
        """Admit a member that has started; replace it if it failed or exceeds `timeout`, s."""
        try:
            member.pid = ray.get(member.start_call, timeout=timeout)
            member.start_call = None
        except (RayError, GetTimeoutError) as error:
            self._replace(member, explain(error, self.config.start_s))

    def _admit_ready(self) -> None:
        """Admit the actors that have started, or answered a superseded call, since last time."""
        for member in self._members:
            if member.start_call is not None and _is_ready(member.start_call):
                self._started(member)
            if member.superseded is not None and _is_ready(member.superseded):
                try:
                    packed, _ = ray.get(member.superseded)
                    self._measure(member, packed)
                    member.superseded = None
                except RayError as error:
                    self._replace(member, explain(error, self.config.rollout_s))
            elif member.superseded is not None and self._overdue(member.requested_s):
                self._replace(member, f"no answer within {self.config.rollout_s:g} s (hung)")

    def _overdue(self, requested_s: float) -> bool:
        return time.monotonic() - requested_s > self.config.rollout_s

    def _redivide(self) -> None:
        """Divide the scenes again over the ready actors if one has none or the gain is large."""
        ready = [m for m in self._members if m.ready]
        if not ready:
            return
        known = sorted(m.cost_s for m in ready if m.cost_s is not None) or [1.0]
        for member in ready:
            if not member.scenes and member.cost_s is not None:
                # It may be slow only for a while: its cost decays until it gets scenes again.
                member.cost_s = min(member.cost_s, _COST_LIMIT * known[0])
                member.cost_s += _COST_DECAY * (known[0] - member.cost_s)
        costs = [known[len(known) // 2] if m.cost_s is None else m.cost_s for m in ready]
        counts = block_counts(len(self._scenes) // self._block, costs)
        now = [len(m.scenes) // self._block for m in ready]
        slow = makespan(now, costs) > _DIVISION_GAIN * makespan(counts, costs)
        self._slow_rollouts = self._slow_rollouts + 1 if slow else 0
        complete = sum(now) * self._block == len(self._scenes)
        new = any(m.cost_s is None and not m.scenes for m in ready)
        if complete and not new and self._slow_rollouts < _DIVISION_ROLLOUTS:
            return
        self._slow_rollouts = 0
        for member in self._members:
            if not member.ready:
                member.scenes = range(0)
        for member, owned in zip(ready, consecutive_ranges(counts, self._block), strict=True):
            if member.scenes != owned:
                member.scenes, member.in_sync = owned, False
                member.handle.own.remote(owned)

    def _assign(
        self,
        collection: Collection,
        member: Member,
        scenes: range,
        arguments: tuple,
        failures: int = 0,
    ) -> None:
        """Request a part from a member, with its state unless the worker has that state."""
        own = member.in_sync and scenes == member.scenes
        fresh = any(not state for state in self._states.values())
        state = None if own else {} if fresh else state_of_scenes(scenes, self._states)
        with self._lock:
            # Under the lock: `prefetch` must not enter the actor's queue before this request.
            reference = member.handle.part.remote(scenes, state, *arguments)
            member.acting |= scenes == member.scenes
        member.requested_s = time.monotonic()
        collection.assign(reference, member, scenes, failures)

    def _assign_queued(self, collection: Collection, arguments: tuple) -> None:
        """Assign queued parts to idle members."""
        busy = {id(job.member) for job in collection.jobs.values()}
        helpers = sum(m.ready for m in self._members)
        for member in self._members:
            idle = member.ready and id(member) not in busy
            # A member that has answered is alive; where no job is left, any member is tried.
            responsive = id(member) in collection.responsive or not collection.jobs
            if collection.queued and idle and responsive:
                scenes, failures = collection.next_part(helpers)
                self._assign(collection, member, scenes, arguments, failures)

    def _wait(self, collection: Collection) -> None:
        """Wait for an answer, for an actor that starts, or for the next deadline; handle it."""
        starting = {m.start_call: m for m in self._members if m.start_call is not None}
        now = time.monotonic()
        due = [job.requested_s + self.config.rollout_s for job in collection.jobs.values()]
        if not collection.jobs:
            due += [m.requested_s + self.config.start_s for m in starting.values()]
        due += [collection.next_straggler_s] if collection.next_straggler_s is not None else []
        references = [*collection.jobs, *starting]
        until_s = max(0.0, min(due, default=now) - now)
        ready, _ = ray.wait(references, timeout=min(_LISTEN_S, until_s))
        if ready:
            ready, _ = ray.wait(references, num_returns=len(references), timeout=_GATHER_S)
        for reference in ready:
            if reference in starting:
                member = starting[reference]
                self._started(member)
                collection.responsive |= {id(member)} if member.start_call is None else set()
            else:
                self._answered(collection, collection.jobs[reference])
        collection.queue_stragglers(time.monotonic())
        if ready:
            return
        for job in list(collection.jobs.values()):
            if self._overdue(job.requested_s):
                self._failed(collection, job, explain(GetTimeoutError(), self.config.rollout_s))
        if not collection.jobs:
            for member in starting.values():
                if time.monotonic() - member.requested_s > self.config.start_s:
                    self._replace(member, explain(GetTimeoutError(), self.config.start_s))

    def _answered(self, collection: Collection, job: Job) -> None:
        member = job.member
        try:
            packed, state = ray.get(job.reference)
        except RayError as error:
            self._failed(collection, job, explain(error, self.config.rollout_s))
            return
        used = collection.deliver(job, packed, state)
        if job.scenes == member.scenes:
            member.in_sync = used
        member.failures = 0
        member.requested_s = time.monotonic()  # its prefetched part begins now
        self._measure(member, packed)

    def _failed(self, collection: Collection, job: Job, cause: str) -> None:
        failures = collection.fail(job)
        self._replace(job.member, cause, job.scenes, failures)

    def _measure(self, member: Member, packed: Mapping[str, Any]) -> None:
        """Update a member's cost by its own clock, without its waits for others."""
        cost = sum(packed["seconds"].values()) / (packed["rewards"].shape[1] / self._block)
        old = cost if member.cost_s is None else member.cost_s
        member.cost_s = old + _COST_WEIGHT * (cost - old)

    def _replace(
        self, member: Member, cause: str, scenes: range | None = None, failures: int = 0
    ) -> None:
        """Replace a member's actor; FleetError after more than `restarts` failures in a row."""
        scenes = scenes or member.scenes
        member.failures += 1
        failures = max(failures, member.failures)
        name = f"actor {member.index}"
        if scenes:
            name += f" (scenes {scenes.start} to {scenes.stop - 1})"
        if failures > self.config.restarts:
            raise FleetError(f"{name} failed {failures} times in a row: {cause}")
        LOG.warning("%s is replaced: %s", name, cause)
        ray.kill(member.handle, no_restart=True)
        self.restarts += 1
        self._start(member)


def _invalidate(prefetched: Iterable[Job]) -> None:
    """Drop prefetched jobs: the next request of their actors carries a state."""
    for job in prefetched:
        job.member.in_sync = False


def _is_ready(reference: Any) -> bool:
    return bool(ray.wait([reference], timeout=0)[0])

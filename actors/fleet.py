"""A fleet of Ray actors that yields the local fleet's numbers, also when actors die, hang or lag.

Rollouts come back as one object-store reference an actor. Measured on two cores, two actors of 256
scenes, horizon 8 (2.8 MB in all): 7 ms an iteration so, 11 to 27 ms as streams of 2 to 8 chunks; in
lockstep nothing can start before the last chunk is there.
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

from actors.collection import Collection, Job, Order
from actors.errors import FleetError
from actors.failures import explain
from actors.local import divide, merge, split
from actors.ray_actor import (
    Arrays,
    MakeShard,
    RolloutActor,
    to_arrays,
    to_tensors,
    unpack_rollout,
)
from actors.division import consecutive_ranges, makespan, block_counts, state_of_scenes
from policy.rollout import Rollout

LOG = logging.getLogger("inhabit.actors")
_MEMORY = 0.3  # weight of the newest measurement of an actor's speed
_FORGIVEN = 0.03  # of what one without work is slower, with each rollout
_SLOWEST = 20.0  # times the others' cost: one that was away for a while is not slow for ever
_GAIN = 1.25  # a division that would be so much quicker, so often in a row, is taken
_PATIENCE = 3
_GATHERED_S = 0.005  # in which more answers are waited for: each look at them costs


@dataclass(frozen=True)
class FleetConfig:
    """How actors are placed, and how long they are trusted."""

    cpus_per_actor: float = 1.0
    """Ray CPU slots of an actor; it acts on one thread"""
    start_s: float = 180.0
    """Seconds that an actor may take to start and compile its scenes"""
    rollout_s: float = 120.0
    """Seconds that a rollout may take before its actor counts as hung and is replaced"""
    late_s: float = 1.0
    """Least lateness at which others collect an actor's part as well as it: the first counts"""
    late_factor: float = 2.0
    """How often the time of the others an actor may take before it is late"""
    restarts: int = 3
    """Failures in a row of the same actor that are mended; the next one ends the run"""


@dataclass(eq=False)
class Member:
    """One actor of the moment."""

    index: int
    handle: Any
    built: Any
    """The call that starts it; None once it has started"""
    asked_s: float
    pid: int = 0
    cost_s: float | None = None
    """Seconds that it takes for a block"""
    scenes: range = range(0)
    """Its own part"""
    holds: bool = False
    """Whether its worker stands where the state of that part does"""
    acts: bool = False
    """Whether it was asked for that part in the last collection, and has not failed since"""
    overtaken: Any = None
    """A call whose answer nobody waits for any more"""
    failures: int = 0

    @property
    def ready(self) -> bool:
        return self.built is None and self.overtaken is None


class RayFleet:
    """Actors that own all scenes between them; needs `actors.cluster.ray_session`.

    The part of an actor that dies, hangs or lags is collected again by the others, or by its
    replacement where there are none, from the state before the rollout and with the same weights:
    since all randomness is a function of (seed, scene, clock), the bits are those of an undisturbed
    run, whoever delivers first. Replacements join when they have started; from then on, and where
    some are slower than others, parts are as large as makes all end at the same time.
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
        self.helped = 0
        """parts that were late, and given to others as well"""
        self._make_shard, self._seed, self._block = make_shard, seed, block
        self._scenes = range(scenes)
        self._unequal = 0
        self._order: Order | None = None
        self._begun: list[Job] = []
        """Of the collection to come"""
        self._beginning = threading.Lock()
        """Held where actors are asked, begun ahead, or replaced"""
        # Ray restarts actors by itself only without their state: the fleet does it instead.
        # Its control store would keep a record of every part asked for: 13 MB in 90 minutes.
        remote: Any = ray.remote  # whose types do not know that option
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
                member.holds = True
        except BaseException:
            self.close()
            raise

    def collect(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> Rollout:
        """One rollout of all scenes, in order; FleetError if an actor fails time and again."""
        order, begun = self._begun_for(weights, version, sigma)
        self._welcome()
        self._divide_again()
        arguments = self._arguments(order)
        asked = Collection(self._scenes, self._block, self.config.late_s, self.config.late_factor)
        for job in self._still_good(begun):
            asked.take_over(job, job.member.asked_s)
            job.member.acts = True
        for member in self._members:
            if member.ready and member.scenes and not member.acts:
                self._ask(asked, member, member.scenes, arguments)
        asked.owe_the_rest()
        while not asked.complete:
            self._give(asked, arguments)
            self._wait(asked)
        for job in asked.jobs.values():
            job.member.overtaken, job.member.holds = job.reference, False
        self.helped += asked.helped
        self._states = {scenes: state for scenes, (_, state) in asked.results.items()}
        return Rollout.join([unpack_rollout(packed) for packed, _ in asked.results.values()])

    def ahead(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> None:
        """What the next `collect` will be called with, told while one is under way.

        Actors begin with it the moment they are done with their part, while the parts of all are
        taken in. It changes no number. May be called from another thread than `collect`.
        """
        if self._order is not None:
            return  # what was told before is not taken up yet: one thing ahead is enough
        order = Order(weights, version, sigma, ray.put(to_arrays(weights)))
        arguments = self._arguments(order)
        with self._beginning:
            self._order = order
            for member in self._members:
                if member.ready and member.acts:
                    # It waits in the actor's queue, behind the part that it is to go on from.
                    reference = member.handle.part.remote(member.scenes, None, *arguments)
                    self._begun.append(Job(reference, member, member.scenes, time.monotonic()))

    def _arguments(self, order: Order) -> tuple:
        return order.published, order.version, self.horizon, order.sigma

    def _begun_for(
        self, weights: Mapping[str, Tensor], version: int, sigma: float
    ) -> tuple[Order, list[Job]]:
        """The order of a collection, and the parts of it that were begun ahead."""
        with self._beginning:
            order, begun = self._order, self._begun
            self._order, self._begun = None, []
            for member in self._members:
                member.acts = False
        if order is not None and order.is_of(weights, version, sigma):
            return order, begun
        _forget(begun)
        return Order(weights, version, sigma, ray.put(to_arrays(weights))), []

    def _still_good(self, begun: list[Job]) -> list[Job]:
        """Those whose actor goes on from the right state; the others' answers are not looked at."""
        good = [
            job
            for job in begun
            if job.member.ready and job.member.holds and job.member.scenes == job.scenes
        ]
        _forget([job for job in begun if job not in good])
        return good

    def alive(self) -> int:
        """Actors that have started and are not known to have failed since."""
        return sum(member.built is None for member in self._members)

    def pids(self) -> list[int]:
        """Process ids of the actors, each on its own node."""
        return [member.pid for member in self._members]

    def division(self) -> list[int]:
        """Scenes of each actor; 0 for one that is not there, or too slow to be of use."""
        return [len(member.scenes) for member in self._members]

    def state_dict(self) -> dict[str, Any]:
        """All scenes' state, as the local fleet gives it."""
        owners = {m.scenes: m for m in self._members}
        states = {
            scenes: state or cast(Arrays, ray.get(owners[scenes].handle.state.remote()))
            for scenes, state in sorted(self._states.items(), key=lambda item: item[0].start)
        }
        copies = [{k: v.clone() for k, v in to_tensors(s).items()} for s in states.values()]
        return merge(copies, list(states))

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Restore what either fleet's `state_dict` gave, over any number of actors."""
        ranges = sorted(self._states, key=lambda scenes: scenes.start)
        parts = split(state, ranges)
        with self._beginning:
            _forget(self._begun)
            self._order, self._begun = None, []
        self._states = {r: to_arrays(part) for r, part in zip(ranges, parts, strict=True)}
        for member in self._members:
            member.holds = False

    def close(self) -> None:
        """End the actors' processes."""
        for member in self._members:
            ray.kill(member.handle, no_restart=True)
        self._members = []

    def _start(self, member: Member) -> None:
        """A new actor in the member's place; it joins when it has started."""
        # One that has no scenes yet makes some, and so reads its clips and compiles its furniture.
        scenes = member.scenes or range(self._block)
        with self._beginning:
            member.handle = self._actor.remote(self._make_shard, scenes, self._seed, self._block)
            member.built = member.handle.build.remote(None)
            member.asked_s = time.monotonic()
            member.cost_s, member.overtaken = None, None
            member.holds = member.acts = False
            self._begun = [job for job in self._begun if job.member is not member]

    def _await_started(self, member: Member) -> None:
        while member.built is not None:
            self._started(member, self.config.start_s)

    def _started(self, member: Member, timeout: float | None = None) -> None:
        """Let it join when it has started; replace it if it could not, or not within `timeout`."""
        try:
            member.pid = ray.get(member.built, timeout=timeout)
            member.built = None
        except (RayError, GetTimeoutError) as error:
            self._replace(member, explain(error, self.config.start_s))

    def _welcome(self) -> None:
        """Take up the actors that have started, or answered at last, since the last rollout."""
        for member in self._members:
            if member.built is not None and _there(member.built):
                self._started(member)
            if member.overtaken is not None and _there(member.overtaken):
                try:
                    packed, _ = ray.get(member.overtaken)
                    self._measure(member, packed)
                    member.overtaken = None
                except RayError as error:
                    self._replace(member, explain(error, self.config.rollout_s))
            elif member.overtaken is not None and self._hung(member.asked_s):
                self._replace(member, f"no answer within {self.config.rollout_s:g} s (hung)")

    def _hung(self, asked_s: float) -> bool:
        return time.monotonic() - asked_s > self.config.rollout_s

    def _divide_again(self) -> None:
        """Give the actors that are ready other parts, where some have none or the gain is large."""
        ready = [m for m in self._members if m.ready]
        if not ready:
            return
        known = sorted(m.cost_s for m in ready if m.cost_s is not None) or [1.0]
        for member in ready:
            if not member.scenes and member.cost_s is not None:
                # Slow for the moment, perhaps: it is tried again after a while.
                member.cost_s = min(member.cost_s, _SLOWEST * known[0])
                member.cost_s += _FORGIVEN * (known[0] - member.cost_s)
        costs = [known[len(known) // 2] if m.cost_s is None else m.cost_s for m in ready]
        counts = block_counts(len(self._scenes) // self._block, costs)
        now = [len(m.scenes) // self._block for m in ready]
        slow = makespan(now, costs) > _GAIN * makespan(counts, costs)
        self._unequal = self._unequal + 1 if slow else 0
        whole = sum(now) * self._block == len(self._scenes)
        new = any(m.cost_s is None and not m.scenes for m in ready)
        if whole and not new and self._unequal < _PATIENCE:
            return
        self._unequal = 0
        for member in self._members:
            if not member.ready:
                member.scenes = range(0)
        for member, owned in zip(ready, consecutive_ranges(counts, self._block), strict=True):
            if member.scenes != owned:
                member.scenes, member.holds = owned, False
                member.handle.own.remote(owned)

    def _ask(
        self,
        asked: Collection,
        member: Member,
        scenes: range,
        arguments: tuple,
        failures: int = 0,
    ) -> None:
        own = member.holds and scenes == member.scenes
        fresh = any(not state for state in self._states.values())
        state = None if own else {} if fresh else state_of_scenes(scenes, self._states)
        with self._beginning:
            # At once for `ahead`, which must not put what comes next before this in the queue.
            reference = member.handle.part.remote(scenes, state, *arguments)
            member.acts |= scenes == member.scenes
        member.asked_s = time.monotonic()
        asked.ask(reference, member, scenes, failures)

    def _give(self, asked: Collection, arguments: tuple) -> None:
        """Parts that are owed to those with nothing to do."""
        busy = {id(job.member) for job in asked.jobs.values()}
        helpers = sum(m.ready for m in self._members)
        for member in self._members:
            idle = member.ready and id(member) not in busy
            # One that has delivered is sure to live; if none has, all are tried.
            sound = id(member) in asked.sound or not asked.jobs
            if asked.owed and idle and sound:
                scenes, failures = asked.take(helpers)
                self._ask(asked, member, scenes, arguments, failures)

    def _wait(self, asked: Collection) -> None:
        """Until something happens: an answer, an actor that has started, a deadline."""
        starting = {m.built: m for m in self._members if m.built is not None}
        now = time.monotonic()
        due = [job.asked_s + self.config.rollout_s for job in asked.jobs.values()]
        if not asked.jobs:
            due += [m.asked_s + self.config.start_s for m in starting.values()]
        due += [asked.late_at_s] if asked.late_at_s is not None else []
        references = [*asked.jobs, *starting]
        ready, _ = ray.wait(references, timeout=max(0.0, min(due, default=now) - now))
        if ready:
            ready, _ = ray.wait(references, num_returns=len(references), timeout=_GATHERED_S)
        for reference in ready:
            if reference in starting:
                member = starting[reference]
                self._started(member)
                asked.sound |= {id(member)} if member.built is None else set()
            else:
                self._answered(asked, asked.jobs[reference])
        asked.look_for_late(time.monotonic())
        if ready:
            return
        for job in list(asked.jobs.values()):
            if self._hung(job.asked_s):
                self._failed(asked, job, explain(GetTimeoutError(), self.config.rollout_s))
        if not asked.jobs:
            for member in starting.values():
                if time.monotonic() - member.asked_s > self.config.start_s:
                    self._replace(member, explain(GetTimeoutError(), self.config.start_s))

    def _answered(self, asked: Collection, job: Job) -> None:
        member = job.member
        try:
            packed, state = ray.get(job.reference)
        except RayError as error:
            self._failed(asked, job, explain(error, self.config.rollout_s))
            return
        used = asked.answer(job, packed, state)
        if job.scenes == member.scenes:
            member.holds = used
        member.failures = 0
        member.asked_s = time.monotonic()  # of what it has begun since
        self._measure(member, packed)

    def _failed(self, asked: Collection, job: Job, cause: str) -> None:
        failures = asked.fail(job)
        self._replace(job.member, cause, job.scenes, failures)

    def _measure(self, member: Member, packed: Mapping[str, Any]) -> None:
        """Its speed, by its own clock: what others made it wait for does not count."""
        cost = sum(packed["seconds"].values()) / (packed["rewards"].shape[1] / self._block)
        old = cost if member.cost_s is None else member.cost_s
        member.cost_s = old + _MEMORY * (cost - old)

    def _replace(
        self, member: Member, cause: str, scenes: range | None = None, failures: int = 0
    ) -> None:
        """Another actor in the member's place; FleetError where that has been tried enough."""
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


def _forget(begun: Iterable[Job]) -> None:
    """What their actors are asked for next waits behind it, and comes with its own state."""
    for job in begun:
        job.member.holds = False


def _there(reference: Any) -> bool:
    return bool(ray.wait([reference], timeout=0)[0])

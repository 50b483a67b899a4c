"""A fleet of stand-ins over Ray: everything of a real one's traffic, and none of its computing."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import ray
from torch import Tensor

from actors.ray_actor import pack_rollout, to_arrays, unpack_rollout
from console.bench.stand_ins import Sleepers
from policy.rollout import Rollout

#: Threads of one process: none of its actors waits for another's.
ACTORS_A_PROCESS = 64
GATHERED_S = 0.005


@contextmanager
def sleepers(part: Rollout, processes: int) -> Iterator[list[Any]]:
    """Processes, started, whose actors send copies of `part`; needs a Ray session."""
    remote: Any = ray.remote  # whose types know either a class or its options
    kind = remote(num_cpus=0, max_concurrency=2 * ACTORS_A_PROCESS)(Sleepers)
    packed = pack_rollout(part)
    hosts = [kind.remote(packed) for _ in range(processes)]
    try:
        ray.get([host.rollout.remote({}, 0, 0, 0, 0.0) for host in hosts])
        yield hosts
    finally:
        for host in hosts:
            ray.kill(host, no_restart=True)


class SleepingFleet:
    """So many actors over the processes of `sleepers`, which each take `seconds` for a rollout.

    Weights go out and rollouts come in as in `RayFleet`: one `ray.put`, one reference an actor,
    joined in scene order; with a prefetched request, actors begin with it when they are done.
    """

    def __init__(self, hosts: list[Any], part: Rollout, actors: int, seconds: float) -> None:
        self.hosts, self.part, self.actors, self.seconds = hosts, part, actors, seconds
        self._begun: list[Any] = []

    @property
    def samples(self) -> int:
        """Control steps of one collection."""
        return self.actors * self.part.samples

    def prefetch(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> None:
        """Request the next collection, with the arguments of its `collect`."""
        if not self._begun:
            self._begun = self.ask(weights, version)

    def collect(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> Rollout:
        """One rollout of all actors."""
        begun, self._begun = self._begun, []
        return self.take_in(begun or self.ask(weights, version))

    def take_in(self, waiting: list[Any]) -> Rollout:
        """The parts of all, as they come, joined."""
        parts = []
        while waiting:
            # As many as are there: looking costs as often as there are actors.
            ready, waiting = ray.wait(waiting)
            if waiting:
                more, waiting = ray.wait(waiting, num_returns=len(waiting), timeout=GATHERED_S)
                ready += more
            parts += [unpack_rollout(packed) for packed in ray.get(ready)]
        return Rollout.join(parts)

    def ask(self, weights: Mapping[str, Tensor], version: int) -> list[Any]:
        """Ask every actor for a rollout; their references."""
        published = ray.put(to_arrays(weights))
        return [
            self.hosts[actor % len(self.hosts)].rollout.remote(
                published, version, actor, actor * self.part.scenes, self.seconds
            )
            for actor in range(self.actors)
        ]

    def alive(self) -> int:
        """Number of actors."""
        return self.actors

    def state_dict(self) -> dict[str, Any]:
        """Nothing: they stand where they stood."""
        return {}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Nothing."""

    def close(self) -> None:
        """The processes are ended by `sleepers`."""

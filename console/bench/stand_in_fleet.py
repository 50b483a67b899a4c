"""A fleet of stand-in actors over Ray, with the traffic of a real one and without computing."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import ray
from torch import Tensor

from actors.ray_actor import pack_rollout, to_arrays, unpack_rollout
from console.bench.stand_ins import Sleepers
from policy.rollout import Rollout

#: Actors of one process, with as many threads, so that none waits for another.
ACTORS_A_PROCESS = 64
GATHERED_S = 0.005


@contextmanager
def sleepers(part: Rollout, processes: int) -> Iterator[list[Any]]:
    """Yield started processes whose actors send copies of `part`; needs a Ray session."""
    remote: Any = ray.remote  # its type hints do not cover a class with options
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
    """A number of actors over the processes of `sleepers`, each with `seconds` per rollout.

    Weights and rollouts are sent as in `RayFleet`: one `ray.put`, one reference per actor, joined
    in scene order; with `prefetch`, actors start the next rollout when the present one is finished.
    """

    def __init__(self, hosts: list[Any], part: Rollout, actors: int, seconds: float) -> None:
        self.hosts, self.part, self.actors, self.seconds = hosts, part, actors, seconds
        self._requested: list[Any] = []

    @property
    def samples(self) -> int:
        """Number of samples of one collection."""
        return self.actors * self.part.samples

    def prefetch(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> None:
        """Request the next collection, with the arguments of its `collect`."""
        if not self._requested:
            self._requested = self.request(weights, version)

    def collect(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> Rollout:
        """Return one rollout of all actors."""
        requested, self._requested = self._requested, []
        return self.receive(requested or self.request(weights, version))

    def receive(self, waiting: list[Any]) -> Rollout:
        """Receive the rollouts of all actors as they finish; return them joined."""
        parts = []
        while waiting:
            # As many as are there: looking costs as often as there are actors.
            ready, waiting = ray.wait(waiting)
            if waiting:
                more, waiting = ray.wait(waiting, num_returns=len(waiting), timeout=GATHERED_S)
                ready += more
            parts += [unpack_rollout(packed) for packed in ray.get(ready)]
        return Rollout.join(parts)

    def request(self, weights: Mapping[str, Tensor], version: int) -> list[Any]:
        """Request a rollout of every actor; return the references."""
        published = ray.put(to_arrays(weights))
        return [
            self.hosts[actor % len(self.hosts)].rollout.remote(
                published, version, actor, actor * self.part.scenes, self.seconds
            )
            for actor in range(self.actors)
        ]

    def alive(self) -> int:
        """Return the number of actors."""
        return self.actors

    def state_dict(self) -> dict[str, Any]:
        """Return an empty state: stand-ins have none."""
        return {}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Ignore the state: stand-ins have none."""

    def close(self) -> None:
        """Do nothing: `sleepers` ends the processes."""

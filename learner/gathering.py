"""Rollouts for the training loop, in lockstep or overlapped with the update."""

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, fields

import torch
from torch import Tensor

from learner.errors import TrainingError
from learner.protocols import Fleet, PrefetchingFleet, State
from policy.rollout import Rollout
from world.device import CPU


@dataclass(frozen=True)
class Gathered:
    """A rollout and the conditions it was collected under."""

    rollout: Rollout
    sigma: float
    """Standard deviation of the action noise"""
    alive: int
    """Workers that took part"""


class Gathering:
    """Rollouts one after the other, each with the weights at the time it begins.

    Overlapped, a rollout begins as soon as the one before it is returned, so that actors act while
    the learner updates: the policy of every rollout but the first is one update old. The weights of
    a rollout do not depend on timing, so the numbers are as reproducible as in lockstep. A
    PrefetchingFleet gets its next arguments even before the present rollout is complete.

    A rollout goes to the learner's device as soon as it is complete: overlapped, while the learner
    updates on the one before it. Two rollouts then take turns in the pinned memory that they pass
    through (world.device.put).
    """

    def __init__(self, fleet: Fleet, overlap: bool = False, device: torch.device = CPU) -> None:
        self.fleet = fleet
        self.device = device
        self._pool = (
            ThreadPoolExecutor(1, "gathering", initializer=torch.set_num_threads, initargs=(1,))
            if overlap
            else None
        )
        self._pending: Future[Gathered] | None = None

    def next(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> Gathered:
        """The next rollout; `weights` act in it or, overlapped, in the rollout that begins now."""
        if self._pool is None:
            return self._collect(weights, version, sigma)
        # The first rollout is not pending yet.
        pending = self._pending or self._pool.submit(self._collect, weights, version, sigma)
        self._pending = None
        if isinstance(self.fleet, PrefetchingFleet):
            self.fleet.prefetch(weights, version, sigma)
        gathered = pending.result()
        self._pending = self._pool.submit(self._collect, weights, version, sigma)
        return gathered

    def _collect(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> Gathered:
        rollout = self.fleet.collect(weights, version, sigma)
        return Gathered(rollout.on(self.device), sigma, self.fleet.alive())

    def state_dict(self) -> State:
        """State of the fleet, and the pending rollout if there is one; waits for that rollout.

        The pending rollout is kept because the weights that made it are not.
        """
        waiting = None if self._pending is None else _state_of(self._pending.result())
        state = {"fleet": self.fleet.state_dict()}
        return state if waiting is None else state | {"waiting": waiting}

    def load_state_dict(self, state: State) -> None:
        """Restore a state; TrainingError where it has a pending rollout and the run is lockstep."""
        waiting = state.get("waiting")
        if waiting is not None and self._pool is None:
            raise TrainingError(
                "this checkpoint holds a rollout that was begun ahead (--lag.overlap): resume with"
                " --lag.overlap, or begin another run from it with --init"
            )
        if self._pending is not None:
            self._pending.result()
        if "fleet" in state:  # a trimmed checkpoint lacks it: all episodes begin anew
            self.fleet.load_state_dict(state["fleet"])
        self._pending = None
        if waiting is not None:
            self._pending = Future()
            self._pending.set_result(_gathered_of(waiting, self.device))

    def close(self) -> None:
        """Wait for a pending rollout and end the thread; the fleet stays open."""
        if self._pool is not None:
            self._pool.shutdown()


def _state_of(gathered: Gathered) -> State:
    """A rollout as tensors and JSON scalars, for a checkpoint."""
    rollout = gathered.rollout
    found = {field.name: getattr(rollout, field.name) for field in fields(rollout)}
    return {"rollout": found, "sigma": gathered.sigma, "alive": gathered.alive}


def _gathered_of(state: State, device: torch.device) -> Gathered:
    rollout = Rollout(**state["rollout"]).on(device)
    return Gathered(rollout, float(state["sigma"]), int(state["alive"]))

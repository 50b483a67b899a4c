"""Rollouts for the training loop, in lockstep or overlapped with the update."""

import contextlib
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, fields

import torch
from torch import Tensor

from learner.errors import TrainingError
from learner.protocols import AbandoningFleet, Fleet, PrefetchingFleet, State
from policy.rollout import Abandoned, Rollout
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
        self._arguments: tuple[Mapping[str, Tensor], int, float] | None = None
        """Arguments of the collection that was begun ahead"""
        self._last: Gathered | None = None
        """Overlapped, the rollout that an update learns from"""
        self._learned = True
        self._rewound = False

    def next(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> Gathered:
        """The next rollout; `weights` act in it or, overlapped, in the rollout that begins now."""
        self._learned = False
        if self._pool is None:
            return self._collect(weights, version, sigma)
        if self._pending is None:  # the first rollout
            self._begin(weights, version, sigma)
        assert self._pending is not None
        if isinstance(self.fleet, PrefetchingFleet):
            self.fleet.prefetch(weights, version, sigma)
        self._last = None
        self._last = self._pending.result()
        self._begin(weights, version, sigma)
        return self._last

    def _begin(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> None:
        """Begin a rollout ahead."""
        assert self._pool is not None
        self._arguments = weights, version, sigma
        self._pending = self._pool.submit(self._collect, weights, version, sigma)

    def learned(self) -> None:
        """Note that the update on the last rollout is complete."""
        self._last, self._learned = None, True

    def rewind(self) -> None:
        """After `AbandoningFleet.abandon`: drop the rollout that nothing was learned from.

        The scenes return to where it began. Overlapped, a complete rollout that the update was to
        learn from is kept, or else the policy of the one that was begun: both in `state_dict`.
        """
        assert isinstance(self.fleet, AbandoningFleet)
        if self._pending is not None:
            with contextlib.suppress(Abandoned):
                self._pending.result()
        if self._pending is not None or not self._learned:
            self.fleet.rewind()
        self._rewound = True

    def _collect(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> Gathered:
        rollout = self.fleet.collect(weights, version, sigma)
        return Gathered(rollout.on(self.device), sigma, self.fleet.alive())

    def state_dict(self) -> State:
        """State of the fleet, and the pending rollout if there is one; waits for that rollout.

        The pending rollout is kept because the weights that made it are not.
        """
        if self._rewound:
            return self._rewound_state()
        waiting = None if self._pending is None else _state_of(self._pending.result())
        state = {"fleet": self.fleet.state_dict()}
        return state if waiting is None else state | {"waiting": waiting}

    def _rewound_state(self) -> State:
        """State after `rewind`: a continuation gathers the same rollouts again."""
        state: State = {"fleet": self.fleet.state_dict()}
        if self._last is not None:
            return state | {"waiting": _state_of(self._last)}
        if self._arguments is not None:
            weights, version, sigma = self._arguments
            return state | {"begun": {"weights": dict(weights), "version": version, "sigma": sigma}}
        return state

    def load_state_dict(self, state: State) -> None:
        """Restore a state; TrainingError where it has a pending rollout and the run is lockstep."""
        waiting, begun = state.get("waiting"), state.get("begun")
        if not (waiting is begun is None) and self._pool is None:
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
        elif begun is not None:
            self._begin(begun["weights"], int(begun["version"]), float(begun["sigma"]))

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

"""Where the loop's rollouts come from: one at a time, or the next while one is learned from."""

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, fields

import torch
from torch import Tensor

from learner.errors import TrainingError
from learner.protocols import Fleet, Foresighted, State
from policy.rollout import Rollout


@dataclass(frozen=True)
class Gathered:
    """A rollout and how it came about."""

    rollout: Rollout
    sigma: float
    """action noise that it was acted with"""
    alive: int
    """workers that took part"""


class Gathering:
    """Rollouts one after the other, always with the weights of the moment they were begun.

    Overlapped, a rollout is begun as soon as the one before it is handed out, so that actors act
    while the learner learns: every rollout but the first is then one update old. Which weights act
    does not depend on who is faster, so the numbers are as reproducible as in lockstep. They are
    known before the one before it is handed out: a fleet that can begins with it by then.
    """

    def __init__(self, fleet: Fleet, overlap: bool = False) -> None:
        self.fleet = fleet
        self._pool = (
            ThreadPoolExecutor(1, "gathering", initializer=torch.set_num_threads, initargs=(1,))
            if overlap
            else None
        )
        self._under_way: Future[Gathered] | None = None

    def next(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> Gathered:
        """The next rollout; `weights` act in it or, overlapped, in the one that is now begun."""
        if self._pool is None:
            return self._collect(weights, version, sigma)
        # The first one has nobody to have begun it.
        waited_for = self._under_way or self._pool.submit(self._collect, weights, version, sigma)
        self._under_way = None
        if isinstance(self.fleet, Foresighted):
            self.fleet.ahead(weights, version, sigma)
        gathered = waited_for.result()
        self._under_way = self._pool.submit(self._collect, weights, version, sigma)
        return gathered

    def _collect(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> Gathered:
        rollout = self.fleet.collect(weights, version, sigma)
        return Gathered(rollout, sigma, self.fleet.alive())

    def state_dict(self) -> State:
        """The fleet at rest, and the rollout that is not used yet, if one was begun: waits for it.

        With both an overlapped run goes on exactly; the rollout was made by weights that are gone.
        """
        waiting = None if self._under_way is None else _state_of(self._under_way.result())
        state = {"fleet": self.fleet.state_dict()}
        return state if waiting is None else state | {"waiting": waiting}

    def load_state_dict(self, state: State) -> None:
        """Restore what `state_dict` gave; TrainingError for an overlapped run's in lockstep."""
        waiting = state.get("waiting")
        if waiting is not None and self._pool is None:
            raise TrainingError(
                "this checkpoint holds a rollout that was begun ahead (--overlap): resume with"
                " --overlap, or begin another run from it with --init"
            )
        if self._under_way is not None:
            self._under_way.result()
        if "fleet" in state:  # a trimmed checkpoint lacks it: all episodes begin anew
            self.fleet.load_state_dict(state["fleet"])
        self._under_way = None
        if waiting is not None:
            self._under_way = Future()
            self._under_way.set_result(_gathered_of(waiting))

    def close(self) -> None:
        """Wait for what was begun, and let go of the thread; the fleet is its owner's."""
        if self._pool is not None:
            self._pool.shutdown()


def _state_of(gathered: Gathered) -> State:
    """Tensors and JSON scalars alone, as checkpoints hold them."""
    rollout = gathered.rollout
    found = {field.name: getattr(rollout, field.name) for field in fields(rollout)}
    return {"rollout": found, "sigma": gathered.sigma, "alive": gathered.alive}


def _gathered_of(state: State) -> Gathered:
    return Gathered(Rollout(**state["rollout"]), float(state["sigma"]), int(state["alive"]))

"""A rollout worker as a Ray actor or process, and the arrays that it exchanges with its fleet."""

import os
import warnings
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any

import numpy as np
import torch
from torch import Tensor

from actors.worker import ShardLike, Worker
from policy.rollout import Rollout

Arrays = dict[str, np.ndarray]
MakeShard = Callable[[range], ShardLike]
"""From the global ids of the scenes to their shard; importable where actors run."""


class RolloutActor:
    """One worker of a process, on one thread.

    The constructor does nothing that can fail: Ray returns the errors of `build` as themselves, but
    those of an actor's constructor as text.
    """

    def __init__(
        self,
        make_shard: MakeShard,
        scenes: range,
        seed: int,
        block: int,
        abandoned: Callable[[], bool] = lambda: False,
    ) -> None:
        """abandoned: whether to end a rollout before its next control step."""
        torch.set_num_threads(1)
        self._abandoned = abandoned
        self._make_shard = make_shard
        self._scenes, self._seed, self._block = scenes, seed, block
        self._worker: Worker | None = None
        self._borrowed: Worker | None = None
        """Worker of scenes that belong to another actor"""

    def build(self, state: Arrays | None) -> int:
        """Make the worker at the first call, load `state` if given; returns the process id."""
        if self._worker is None:
            shard = self._make_shard(self._scenes)
            self._worker = self._make_worker(shard, self._scenes)
        if state is not None:
            self._worker.load_state_dict(to_tensors(state))
        return os.getpid()

    def rollout(
        self, weights: Arrays, version: int, horizon: int, sigma: float
    ) -> tuple[dict[str, Any], Arrays]:
        """One rollout, packed, and the worker's state after it."""
        worker = self._built()
        rollout = worker.rollout(to_tensors(weights), version, horizon, sigma)
        return pack_rollout(rollout), to_arrays(worker.state_dict())

    def part(
        self,
        scenes: range,
        state: Arrays | None,
        weights: Arrays,
        version: int,
        horizon: int,
        sigma: float,
    ) -> tuple[dict[str, Any], Arrays]:
        """As `rollout`, of any scenes, beginning at `state`.

        state: None is the present state of this actor's worker of these scenes; empty is the state
        of a new shard.
        """
        worker = self._worker_of(scenes, fresh=state == {})
        if state:
            worker.load_state_dict(to_tensors(state))
        rollout = worker.rollout(to_tensors(weights), version, horizon, sigma)
        return pack_rollout(rollout), to_arrays(worker.state_dict())

    def _worker_of(self, scenes: range, fresh: bool) -> Worker:
        """The worker of these scenes: the own one, the borrowed one, or a new borrowed one."""
        for worker in (self._worker, self._borrowed):
            if (
                worker is not None
                and worker.scenes == scenes
                and not (fresh and worker.shard.clock)
            ):
                return worker
        made = self._make_worker(self._make_shard(scenes), scenes)
        self._borrowed = made
        return made

    def own(self, scenes: range) -> None:
        """Make these scenes the actor's own, and drop any other worker."""
        worker = self._worker_of(scenes, fresh=False) if scenes else None
        self._worker, self._borrowed, self._scenes = worker, None, scenes

    def state(self) -> Arrays:
        """State of the worker, for a checkpoint before the first rollout."""
        return to_arrays(self._built().state_dict())

    def rewind(self) -> None:
        """Return the worker's scenes to the beginning of its last rollout."""
        self._built().rewind()

    def _make_worker(self, shard: ShardLike, scenes: range) -> Worker:
        return Worker(shard, scenes, self._seed, self._block, abandoned=self._abandoned)

    def _built(self) -> Worker:
        if self._worker is None:
            raise RuntimeError("no worker: call build first")
        return self._worker


def to_arrays(tensors: Mapping[str, Tensor]) -> Arrays:
    """Tensors as numpy arrays, which Ray reads from shared memory without a copy or pickling."""
    return {name: tensor.detach().cpu().contiguous().numpy() for name, tensor in tensors.items()}


def to_tensors(arrays: Mapping[str, np.ndarray]) -> dict[str, Tensor]:
    """Arrays as tensors that share their memory; copy before writing, it may be read-only."""
    with warnings.catch_warnings(action="ignore"):  # torch warns of each read-only array
        return {name: torch.from_numpy(array) for name, array in arrays.items()}


def pack_rollout(rollout: Rollout) -> dict[str, Any]:
    """Fields of a rollout by name, tensors as numpy arrays."""
    found = {field.name: getattr(rollout, field.name) for field in fields(rollout)}
    tensors = {name: value for name, value in found.items() if isinstance(value, Tensor)}
    return found | to_arrays(tensors) | {"episodes": to_arrays(rollout.episodes)}


def unpack_rollout(packed: Mapping[str, Any]) -> Rollout:
    """Rollout from its packed fields; its tensors share the memory of the arrays."""
    found: dict[str, Any] = dict(packed)
    arrays = {name: value for name, value in packed.items() if isinstance(value, np.ndarray)}
    found |= to_tensors(arrays)
    found["episodes"] = to_tensors(packed["episodes"])
    return Rollout(**found)

"""A rollout worker in a process of its own, as a Ray actor, and what crosses to it and back."""

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
"""From the global ids of its scenes to a shard; importable where actors run."""


class RolloutActor:
    """Holds one worker; single-threaded, so that a core each is all that actors need.

    Construction does nothing that can fail: errors of `build` come back as themselves, those of a
    Ray actor's constructor as text.
    """

    def __init__(self, make_shard: MakeShard, scenes: range, seed: int, block: int) -> None:
        torch.set_num_threads(1)
        self._make_shard = make_shard
        self._scenes, self._seed, self._block = scenes, seed, block
        self._worker: Worker | None = None
        self._guest: Worker | None = None

    def build(self, state: Arrays | None) -> int:
        """Make the worker once, take up `state` where there is one; returns the process id."""
        if self._worker is None:
            shard = self._make_shard(self._scenes)
            self._worker = Worker(shard, self._scenes, self._seed, self._block)
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
        """As `rollout`, of any scenes, from `state`.

        None: from where this actor's worker of these scenes stands. Empty: from their beginning.
        """
        worker = self._worker_of(scenes, fresh=state == {})
        if state:
            worker.load_state_dict(to_tensors(state))
        rollout = worker.rollout(to_tensors(weights), version, horizon, sigma)
        return pack_rollout(rollout), to_arrays(worker.state_dict())

    def _worker_of(self, scenes: range, fresh: bool) -> Worker:
        """One of two workers that are kept, the own and that of another actor's scenes."""
        for worker in (self._worker, self._guest):
            if (
                worker is not None
                and worker.scenes == scenes
                and not (fresh and worker.shard.clock)
            ):
                return worker
        made = Worker(self._make_shard(scenes), scenes, self._seed, self._block)
        self._guest = made
        return made

    def own(self, scenes: range) -> None:
        """From now on these scenes are this actor's own; a worker of others is let go."""
        worker = self._worker_of(scenes, fresh=False) if scenes else None
        self._worker, self._guest, self._scenes = worker, None, scenes

    def state(self) -> Arrays:
        """The worker's state, for a checkpoint before the first rollout."""
        return to_arrays(self._built().state_dict())

    def _built(self) -> Worker:
        if self._worker is None:
            raise RuntimeError("asked to act before it was built")
        return self._worker


def to_arrays(tensors: Mapping[str, Tensor]) -> Arrays:
    """As numpy, which Ray reads back from shared memory without a copy (torch it would pickle)."""
    return {name: tensor.detach().cpu().contiguous().numpy() for name, tensor in tensors.items()}


def to_tensors(arrays: Mapping[str, np.ndarray]) -> dict[str, Tensor]:
    """Views, not copies: whoever writes to them copies first, since they may be shared memory."""
    with warnings.catch_warnings(action="ignore"):  # torch warns of every array not writable
        return {name: torch.from_numpy(array) for name, array in arrays.items()}


def pack_rollout(rollout: Rollout) -> dict[str, Any]:
    """The rollout's fields, tensors as numpy."""
    found = {field.name: getattr(rollout, field.name) for field in fields(rollout)}
    tensors = {name: value for name, value in found.items() if isinstance(value, Tensor)}
    return found | to_arrays(tensors) | {"episodes": to_arrays(rollout.episodes)}


def unpack_rollout(packed: Mapping[str, Any]) -> Rollout:
    """The inverse of `pack_rollout`; its tensors are views of the packed arrays."""
    found: dict[str, Any] = dict(packed)
    arrays = {name: value for name, value in packed.items() if isinstance(value, np.ndarray)}
    found |= to_tensors(arrays)
    found["episodes"] = to_tensors(packed["episodes"])
    return Rollout(**found)

"""A fleet in one process: one worker per thread, their rollouts joined in scene order."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from typing import Any

import torch
from torch import Tensor

from actors.worker import ShardLike, Worker
from policy.errors import LayoutError
from policy.rollout import Abandoned, Rollout
from world.device import CPU
from world.errors import ConfigError


def divide(scenes: int, block: int, workers: int) -> list[range]:
    """Ranges of whole blocks of scenes, one per worker; the first ones have one block more.

    Raises ConfigError where the scenes are not whole blocks or the blocks fewer than the workers.
    """
    blocks, rest = divmod(scenes, block)
    if rest or blocks < workers:
        raise ConfigError(
            f"{scenes} scenes cannot be shared by {workers} actors in whole blocks of {block}:"
            f" --scenes must be a multiple of {block}, at least {block * workers} (--block sets the"
            " size of a block)"
        )
    share, more = divmod(blocks, workers)
    ranges, first = [], 0
    for worker in range(workers):
        last = first + (share + (worker < more)) * block
        ranges.append(range(first, last))
        first = last
    return ranges


def merge(parts: Sequence[Mapping[str, Tensor]], ranges: Sequence[range]) -> dict[str, Any]:
    """State of all scenes from the shards' states: tensors with a row per scene are concatenated.

    Any other tensor (the clock) must be the same in all shards, else LayoutError, and is kept once.
    """
    merged: dict[str, Tensor] = {}
    for key, first in parts[0].items():
        values = [part[key] for part in parts]
        if all(_by_scene(v, len(r)) for v, r in zip(values, ranges, strict=True)):
            merged[key] = torch.cat(values)
        elif all(torch.equal(first, v) for v in values):
            merged[key] = first
        else:
            raise LayoutError(f"shards disagree on '{key}', which has no row a scene")
    return {"scenes": ranges[-1].stop, "shard": merged}


def split(state: Mapping[str, Any], ranges: Sequence[range]) -> list[dict[str, Tensor]]:
    """States of shards from the state of all scenes: the inverse of `merge`, for any division.

    Raises LayoutError where the state has another number of scenes.
    """
    scenes = ranges[-1].stop
    if int(state["scenes"]) != scenes:
        raise LayoutError(
            f"the checkpoint is of {state['scenes']} scenes, this fleet has {scenes}: resume with"
            f" --scenes {state['scenes']}"
        )
    return [
        {
            key: v[owned.start : owned.stop].clone() if _by_scene(v, scenes) else v
            for key, v in state["shard"].items()
        }
        for owned in ranges
    ]


def _by_scene(value: Tensor, scenes: int) -> bool:
    return value.ndim > 0 and value.shape[0] == scenes


class LocalFleet:
    """Workers in threads; torch and the simulator release the interpreter's lock."""

    def __init__(
        self,
        make_shard: Callable[[range], ShardLike],
        scenes: int,
        block: int = 64,
        workers: int = 2,
        seed: int = 0,
        horizon: int = 8,
        device: torch.device = CPU,
    ) -> None:
        """device: where the shards' tensors are."""
        self.horizon = horizon
        self._abandoned = False
        self._pool = ThreadPoolExecutor(
            workers, "actor", initializer=torch.set_num_threads, initargs=(1,)
        )
        self._ranges = ranges = divide(scenes, block, workers)
        shards = self._pool.map(make_shard, ranges)
        self.workers = [
            Worker(shard, owned, seed, block, device, lambda: self._abandoned)
            for shard, owned in zip(shards, ranges, strict=True)
        ]

    def collect(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> Rollout:
        """One rollout of all scenes, in scene order; raises a worker's error, or Abandoned."""
        futures = [
            self._pool.submit(worker.rollout, weights, version, self.horizon, sigma)
            for worker in self.workers
        ]
        wait(futures)
        if self._abandoned:
            raise Abandoned
        return Rollout.join([future.result() for future in futures])

    def abandon(self) -> None:
        """See learner.protocols.AbandoningFleet."""
        self._abandoned = True

    def rewind(self) -> None:
        """Return all scenes to the beginning of the last collection."""
        for worker in self.workers:
            worker.rewind()

    def alive(self) -> int:
        """Number of workers."""
        return len(self.workers)

    def state_dict(self) -> dict[str, Any]:
        """State of all scenes, equal to that of one shard with all of them."""
        return merge([worker.state_dict() for worker in self.workers], self._ranges)

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Restore a state, made with any number of workers; LayoutError for other scenes."""
        parts = split(state, self._ranges)
        for worker, part in zip(self.workers, parts, strict=True):
            worker.load_state_dict(part)

    def close(self) -> None:
        """End the threads."""
        self._pool.shutdown()

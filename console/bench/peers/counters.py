"""Counts of rewards and ends of episodes on the side of the scenes: the same for every library.

Each shard has a file of numbers that grow; what a library trained on in a window is the difference
of two readings.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from actors.ray_actor import MakeShard
from actors.worker import ShardLike, StepLike
from world.errors import InhabitError


class CountError(InhabitError):
    """A shard that began anew, so that its counts are not those of one training."""


@dataclass(frozen=True)
class Counts:
    """Sums since the scenes were made."""

    control_steps: float = 0.0
    """Control steps of all scenes."""
    reward: float = 0.0
    """Task reward of these; 0 where a scene became non-finite."""
    episodes: float = 0.0
    """Episodes that ended, in any way."""
    returns: float = 0.0
    """Undiscounted returns of these."""
    falls: float = 0.0
    """Episodes that ended in a terminal state, or non-finite."""

    def __sub__(self, earlier: "Counts") -> "Counts":
        pairs = ((getattr(self, f.name), getattr(earlier, f.name)) for f in fields(self))
        return Counts(*(now - before for now, before in pairs))


def read(folder: Path) -> Counts:
    """Return the counts of all shards of a folder."""
    found = [np.load(file, mmap_mode="r") for file in sorted(folder.glob("*.npy"))]
    return Counts(*np.sum(found, axis=0).tolist()) if found else Counts()


class CountedShard:
    """A shard whose steps are counted in a file; a ShardLike.

    A restored state is not counted back: fleets restore none in a lockstep training.
    """

    def __init__(self, shard: ShardLike, file: Path) -> None:
        """Raises CountError where the file exists: another shard of these scenes was counted."""
        if file.exists():
            raise CountError(f"the scenes from {file.stem} on began anew in the same training")
        self._shard = shard
        wide = len(fields(Counts))
        self._counts = np.lib.format.open_memmap(file, "w+", dtype=np.float64, shape=(wide,))
        self._returns = torch.zeros(len(shard.observe()[0]), dtype=torch.float64)

    @property
    def clock(self) -> int:
        """See ShardLike."""
        return self._shard.clock

    def observe(self) -> tuple[Tensor, Tensor]:
        """See ShardLike."""
        return self._shard.observe()

    def update_sampling(self, published: Mapping[str, Tensor]) -> None:
        """See ShardLike."""
        self._shard.update_sampling(published)

    def step(self, action: Tensor) -> StepLike:
        """One control step with actions [n, 28], counted."""
        step = self._shard.step(action)
        reward = torch.where(step.finite, step.reward, 0.0).double()
        self._returns += reward
        fell = step.fell | ~step.finite
        ended = fell | step.timed_out
        self._counts += (
            len(reward),
            float(reward.sum()),
            int(ended.sum()),
            float(self._returns[ended].sum()),
            int(fell.sum()),
        )
        self._returns[ended] = 0.0
        return step

    def state_dict(self) -> dict[str, Tensor]:
        """See ShardLike."""
        return self._shard.state_dict()

    def load_state_dict(self, state: dict[str, Tensor]) -> None:
        """See ShardLike."""
        self._shard.load_state_dict(state)


@dataclass(frozen=True)
class MakeCounted:
    """Factory of counted shards; it can be pickled where `make` can."""

    make: MakeShard
    folder: str

    def __call__(self, scenes: range) -> ShardLike:
        return CountedShard(self.make(scenes), Path(self.folder) / f"{scenes.start}.npy")


def counted(make: MakeShard, folder: str) -> MakeShard:
    """Return the factory of shards that count in a folder; without one, the factory itself."""
    return MakeCounted(make, folder) if folder else make

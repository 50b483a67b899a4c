"""Replay of past policy transitions, filled deterministically by batch id."""

from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from world.device import CPU, put

INSERTION = 1  # keeps the random stream of insertions apart from that of training


class Replay:
    """Rows of network input in one preallocated tensor.

    Until the replay is full, all rows are kept; then each replaces a random one with a small
    probability. The draws depend only on (seed, batch id): inserting a batch twice from the same
    state writes the same rows to the same slots.
    """

    def __init__(
        self,
        capacity: int,
        width: int,
        seed: int,
        path: Path | None = None,
        device: torch.device = CPU,
    ) -> None:
        """path: file that backs the tensor, so that it outlives a killed process; on the CPU
        alone."""
        self.capacity = capacity
        self.seed = seed
        self.size = 0
        if path is None:
            self.rows = torch.empty(capacity, width, device=device)
        else:
            self.rows = torch.from_file(str(path), shared=True, size=capacity * width)
            self.rows = self.rows.view(capacity, width)

    def insert(self, rows: Tensor, batch: int, probability: float) -> int:
        """Insert rows [n, width] of batch id `batch`; returns the number of rows kept."""
        free = min(self.capacity - self.size, len(rows))
        self.rows[self.size : self.size + free] = rows[:free]
        self.size += free
        rest = rows[free:]
        if len(rest) == 0:
            return free
        draw = np.random.default_rng((INSERTION, self.seed, batch))
        chosen = np.flatnonzero(draw.random(len(rest)) < probability)[: self.capacity]
        # Distinct slots, so that the result does not depend on the order of writes.
        slots = draw.choice(self.capacity, size=len(chosen), replace=False)
        places, taken = (put(torch.from_numpy(at), self.rows.device) for at in (slots, chosen))
        self.rows[places] = rest[taken]
        return free + len(chosen)

    def sample(self, n: int, draw: np.random.Generator) -> Tensor:
        """n rows, drawn uniformly with replacement; needs size > 0."""
        rows = torch.from_numpy(draw.integers(self.size, size=n))
        return self.rows[put(rows, self.rows.device)]

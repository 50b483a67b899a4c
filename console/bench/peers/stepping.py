"""Our scenes alone, with random actions: the limit of every library that trains on them here."""

from collections.abc import Iterator
from contextlib import contextmanager

import torch

from console.bench.peers import protocol, scenes
from console.bench.peers.protocol import Assignment, Iterate
from world.character.model import NU


@contextmanager
def open_peer(assignment: Assignment) -> Iterator[Iterate]:
    """Open the scenes; an iteration has as many steps as that of a training."""
    ours = scenes.in_processes(assignment)

    def iterate() -> int:
        for _ in range(assignment.experiment.horizon):
            ours.step(assignment.sigma * torch.randn(ours.n, NU))
        return assignment.batch

    try:
        yield iterate
    finally:
        ours.close()


if __name__ == "__main__":
    protocol.serve(open_peer)

"""`inhabit train`'s own loop over Ray actors in a process of `inhabit bench peers`."""

import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import torch

from console.bench.peers import protocol
from console.bench.peers.ours import iterating
from console.bench.peers.protocol import Assignment, Iterate
from console.run import assembly
from console.run.directory import RunDirectory


@contextmanager
def open_peer(assignment: Assignment) -> Iterator[Iterate]:
    """Open a training by the task reward alone, on a Ray of its own, with as many actors as the
    assignment has threads."""
    from actors.cluster import ray_session
    from actors.fleet import RayFleet

    experiment, actors = assignment.experiment, assignment.threads
    torch.set_num_threads(1)  # the learner has threads of its own
    student = assembly.learner(experiment)
    with tempfile.TemporaryDirectory() as folder, ray_session(actors):
        make = assembly.make_shard(experiment, RunDirectory(Path(folder)))
        fleet = RayFleet(
            make, experiment.scenes, experiment.block, actors, experiment.seed, experiment.horizon
        )
        with closing(fleet), iterating(assignment, student, fleet, None) as iterate:
            yield iterate


if __name__ == "__main__":
    protocol.serve(open_peer)

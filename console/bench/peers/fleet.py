"""`inhabit train`'s own loop over Ray actors in a process of `inhabit bench peers`."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import torch

from console.bench.peers import protocol
from console.bench.peers.ours import Nowhere
from console.bench.peers.protocol import Assignment, Iterate
from console.run import assembly
from console.run.directory import RunDirectory
from learner.config import LoopConfig
from learner.loop import Loop
from world import tasks


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
        terms = list(tasks.make(experiment.world.task).terms)
        nowhere = Nowhere()
        loop = Loop(student, fleet, None, nowhere, nowhere, LoopConfig(), terms)

        def iterate() -> int:
            loop.iterate()
            return assignment.batch

        try:
            yield iterate
        finally:
            loop.close()
            fleet.close()


if __name__ == "__main__":
    protocol.serve(open_peer)

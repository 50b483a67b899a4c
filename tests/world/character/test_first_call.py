"""The first cosines of a process, by two threads at once, against those in double precision."""

import multiprocessing
from multiprocessing.queues import SimpleQueue

import torch

from world.character import kinematics, model

#: Without world.vector_math up to 40 of 100 processes were wrong, by 1.5e-4. How many depends on
#: the load: of eight runs of this test half failed.
PROCESSES = 40
TOLERANCE = 1e-6


def _worst_error(errors: "SimpleQueue[float]") -> None:
    qpos = torch.linspace(0.1, 1.5, 1764 * model.NQ).view(-1, model.NQ)
    found = kinematics.local_rotations(qpos).double()
    errors.put(float((found - kinematics.local_rotations(qpos.double())).abs().max()))


def test_the_first_call_by_two_threads_is_right_in_every_process() -> None:
    context = multiprocessing.get_context("forkserver")
    # what a training has imported: with less of it the two threads did not meet
    context.set_forkserver_preload(["console.training.command"])
    errors = context.SimpleQueue()
    found = []
    for _ in range(PROCESSES):
        process = context.Process(target=_worst_error, args=(errors,))
        process.start()
        found.append(errors.get())
        process.join()
    assert max(found) < TOLERANCE, found

"""A fleet of local processes without Ray, one worker per process.

Torch and the simulator release the interpreter's lock, but each of the hundred small operations of
a step takes it again: measured on two cores, two threads stepped their scenes at half the rate of
two processes.
"""

import copy
import ctypes
import multiprocessing
import signal
from collections.abc import Mapping
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from multiprocessing.sharedctypes import RawValue
from typing import Any

from torch import Tensor

from actors.errors import FleetError
from actors.local import divide, merge, split
from actors.ray_actor import (
    Arrays,
    MakeShard,
    RolloutActor,
    to_arrays,
    to_tensors,
    unpack_rollout,
)
from policy.rollout import Abandoned, Rollout

_JOIN_S = 5.0
"""Longest time for a worker to end before it is killed."""


class ProcessFleet:
    """Workers in processes; the numbers equal those of `LocalFleet`.

    make_shard: pickled, so that it and its result must be importable. The workers start and build
    their scenes in parallel with what the caller does until `ready`. A worker's error is raised by
    the call in which it occurs, that of building by the first call; FleetError where a worker has
    died.
    """

    def __init__(
        self,
        make_shard: MakeShard,
        scenes: int,
        block: int = 64,
        workers: int = 2,
        seed: int = 0,
        horizon: int = 8,
    ) -> None:
        self.horizon = horizon
        self._ranges = divide(scenes, block, workers)
        # Forking a process whose torch has threads can leave a lock held indefinitely.
        context = multiprocessing.get_context("spawn")
        #: 1 once collections are to end; a raw byte, as a signal handler must take no lock.
        self._abandoned = RawValue(ctypes.c_bool, False)
        self._pipes: list[Connection] = []
        self._processes: list[Any] = []
        self._building = False
        try:
            for index, owned in enumerate(self._ranges):
                ours, theirs = context.Pipe()
                process = context.Process(
                    target=_serve,
                    args=(theirs, make_shard, owned, seed, block, self._abandoned),
                    name=f"actor-{index}",
                    daemon=True,
                )
                process.start()
                theirs.close()
                self._pipes.append(ours)
                self._processes.append(process)
            self._send_all("build", [(None,)] * workers)
            self._building = True
        except BaseException:
            self.close()
            raise

    def ready(self) -> None:
        """Wait until all workers have built their scenes; raises the first error of building."""
        if self._building:
            self._building = False
            self._receive_all()

    def collect(self, weights: Mapping[str, Tensor], version: int, sigma: float) -> Rollout:
        """One rollout of all scenes, in order; raises Abandoned after `abandon`."""
        arguments = (to_arrays(weights), version, self.horizon, sigma)
        answers = self._call_all("rollout", [arguments] * len(self._pipes))
        if self._abandoned.value:
            raise Abandoned
        return Rollout.join([unpack_rollout(packed) for packed in answers])

    def abandon(self) -> None:
        """See learner.protocols.AbandoningFleet."""
        self._abandoned.value = True

    def rewind(self) -> None:
        """Return all scenes to the beginning of the last collection."""
        self._call_all("rewind", [()] * len(self._pipes))

    def alive(self) -> int:
        """Number of workers whose processes run."""
        return sum(process.is_alive() for process in self._processes)

    def pids(self) -> list[int]:
        """Process ids of the workers, in scene order."""
        return [process.pid for process in self._processes]

    def state_dict(self) -> dict[str, Any]:
        """State of all scenes, equal to that of one shard with all of them."""
        states: list[Arrays] = self._call_all("state", [()] * len(self._pipes))
        return merge([to_tensors(state) for state in states], self._ranges)

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Restore a state, made with any number of workers; LayoutError for other scenes."""
        parts = split(state, self._ranges)
        self._call_all("build", [(to_arrays(part),) for part in parts])

    def close(self) -> None:
        """End the processes."""
        for pipe in self._pipes:
            pipe.close()
        for process in self._processes:
            process.join(_JOIN_S)
            if process.is_alive():
                process.kill()
                process.join()
        self._pipes, self._processes = [], []

    def _call_all(self, method: str, arguments: list[tuple]) -> list[Any]:
        """Call a method of all workers; returns the results in scene order."""
        self.ready()
        self._send_all(method, arguments)
        return self._receive_all()

    def _send_all(self, method: str, arguments: list[tuple]) -> None:
        packed, last = b"", None
        for index, (pipe, given) in enumerate(zip(self._pipes, arguments, strict=True)):
            if given is not last:
                # weights are the same for all workers, and packed once
                packed, last = bytes(ForkingPickler.dumps((method, given))), given
            try:
                pipe.send_bytes(packed)
            except OSError:
                raise self._lost(index) from None

    def _receive_all(self) -> list[Any]:
        """The answers of all workers, in scene order.

        All workers have answered before the first error is raised.
        """
        answers = [self._answer(index) for index in range(len(self._pipes))]
        for answer in answers:
            if isinstance(answer, Exception):
                raise answer
        return answers

    def _answer(self, index: int) -> Any:
        try:
            return self._pipes[index].recv()
        except (EOFError, OSError):
            return self._lost(index)

    def _lost(self, index: int) -> FleetError:
        owned, process = self._ranges[index], self._processes[index]
        process.join(_JOIN_S)
        return FleetError(
            f"actor {index} (scenes {owned.start} to {owned.stop - 1}) died, exit code"
            f" {process.exitcode} (killed, out of memory, or crashed): --resume goes on from the"
            " last checkpoint"
        )


def _serve(
    pipe: Connection,
    make_shard: MakeShard,
    scenes: range,
    seed: int,
    block: int,
    abandoned: "ctypes.c_bool",
) -> None:
    """Main loop of a worker's process: answer calls until the pipe closes."""
    # Ctrl-C reaches the whole process group, but the learner decides when its workers end.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    actor = RolloutActor(make_shard, scenes, seed, block, lambda: abandoned.value)
    while True:
        try:
            method, arguments = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            answer: Any = getattr(actor, method)(*arguments)
            if method == "rollout":
                answer = answer[0]  # the state is called for where a checkpoint needs it
        except Exception as error:
            answer = _sendable(error)
        try:
            pipe.send(answer)
        except OSError:
            return


def _sendable(error: Exception) -> Exception:
    """The error itself where it can be pickled, else a FleetError with its text."""
    try:
        copy.copy(error)  # uses the protocol of pickling
    except Exception:
        return FleetError(f"{type(error).__name__}: {error}")
    return error

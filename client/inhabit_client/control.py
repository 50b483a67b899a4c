"""Control of one character at the control rate: a stream with one reply for each situation."""

import queue
import threading
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhabit_client.closing import Closing
from inhabit_client.errors import ServiceError, told
from inhabit_client.v1 import policy_pb2 as pb
from inhabit_client.v1 import policy_pb2_grpc as stubs


@dataclass(frozen=True)
class Actions:
    """Actions of n rows."""

    action: NDArray[np.float32]
    """[n, 28]."""
    target: NDArray[np.float32]
    """[n, 28]: set-points of the servos, rad, clamped to their bounds."""
    version: str
    """Version of the policy."""


def actions(action: bytes, target: bytes, version: str, rows: int) -> Actions:
    """Return actions of the bytes of a reply."""
    first, second = (np.frombuffer(part, "<f4").reshape(rows, -1) for part in (action, target))
    return Actions(first, second, version)


class Session(Closing):
    """An open stream; `with` closes it."""

    def __init__(
        self, stub: stubs.PolicyStub, policy: str, seed: int | None, deadline_s: float = 60.0
    ) -> None:
        self._policy, self._seed, self._sequence = policy, seed, 0
        self._deadline_s = deadline_s
        self._waiting: queue.SimpleQueue[pb.ControlRequest | None] = queue.SimpleQueue()
        self._replies = stub.Control(self._requests())
        self.dropped = 0
        """Number of frames that the service missed."""

    def step(self, situation: pb.Situation, sequence: int | None = None) -> Actions:
        """Return the action of a situation. Raises ServiceError; one of no answer within the
        deadline ends the stream.

        sequence: number of the frame, which must increase; by default the one after the last.
        """
        number = self._sequence if sequence is None else sequence
        self._sequence = number + 1
        self._waiting.put(
            pb.ControlRequest(
                task=self._policy, sequence=number, situation=situation, seed=self._seed
            )
        )
        late = threading.Event()

        def give_up() -> None:
            late.set()
            self._replies.cancel()

        timer = threading.Timer(self._deadline_s, give_up)
        timer.daemon = True
        timer.start()
        try:
            with told():
                reply: pb.ControlReply = next(self._replies)
        except ServiceError as error:
            if late.is_set():
                text = f"no answer within {self._deadline_s:g} s: the stream is closed"
                raise ServiceError("DEADLINE_EXCEEDED", text) from error
            raise
        finally:
            timer.cancel()
        self.dropped = reply.dropped
        return actions(reply.action, reply.target, reply.version, 1)

    def close(self) -> None:
        """End the stream."""
        self._waiting.put(None)
        self._replies.cancel()

    def _requests(self) -> Iterator[pb.ControlRequest]:
        while (request := self._waiting.get()) is not None:
            yield request

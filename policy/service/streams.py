"""Open streams: a limit on their number, and time-outs of idle clients."""

import asyncio
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import grpc
from prometheus_client import Gauge

from policy.errors import BusyError
from rpc.errors import RefusedError


@dataclass(eq=False)
class Stream:
    """One streaming call; its handler records what it waits for, so that it can be timed out."""

    task: "asyncio.Task[object]"
    since: float
    writing: bool = False
    """Whether it waits for the client to read a reply, rather than to send a message"""
    working: bool = False
    """Whether the client waits for it"""
    ended: RefusedError | None = None
    """Why the stream was ended from outside"""

    def reads(self) -> None:
        """Record that it waits for the client's next message."""
        self.since, self.writing, self.working = time.monotonic(), False, False

    def writes(self) -> None:
        """Record that it waits for the client to read a reply."""
        self.since, self.writing, self.working = time.monotonic(), True, False

    def works(self) -> None:
        """Record that the client waits for it, which no time-out ends."""
        self.since, self.writing, self.working = time.monotonic(), False, True


class Streams:
    """Open streams of one method."""

    def __init__(self, what: str, limit: int, gauge: Gauge | None = None) -> None:
        """what: plural noun for messages."""
        self._what, self._limit, self._gauge = what, limit, gauge
        self._open: set[Stream] = set()

    def __len__(self) -> int:
        return len(self._open)

    @contextmanager
    def one(self) -> Iterator[Stream]:
        """Stream of this call; BusyError at the limit, RefusedError if it is ended from outside."""
        if len(self._open) >= self._limit:
            raise BusyError(
                f"{len(self._open)} {self._what} are open and at most {self._limit} may be: "
                "close one, or ask another server"
            )
        task = asyncio.current_task()
        assert task is not None
        stream = Stream(task, time.monotonic())
        # compared by identity (eq=False)
        self._open.add(stream)
        self._count()
        try:
            yield stream
        except asyncio.CancelledError:
            if stream.ended is None:
                raise
            raise stream.ended from None
        finally:
            self._open.discard(stream)
            self._count()

    def end_idle(self, idle_s: float, stalled_s: float) -> None:
        """End streams whose client sends nothing for idle_s, or reads nothing for stalled_s."""
        now = time.monotonic()
        for stream in list(self._open):
            if stream.working:
                continue
            timeout_s = stalled_s if stream.writing else idle_s
            if now - stream.since > timeout_s:
                did = "took no reply" if stream.writing else "sent nothing"
                self._end(
                    stream,
                    grpc.StatusCode.DEADLINE_EXCEEDED,
                    f"the client {did} for {timeout_s:g} s: the stream is closed",
                )

    def end_all(self, why: str) -> None:
        """End all streams with UNAVAILABLE."""
        for stream in list(self._open):
            self._end(stream, grpc.StatusCode.UNAVAILABLE, why)

    def _end(self, stream: Stream, code: grpc.StatusCode, why: str) -> None:
        if stream.ended is None:
            stream.ended = RefusedError(code, why)
            stream.task.cancel()

    def _count(self) -> None:
        if self._gauge is not None:
            self._gauge.set(len(self._open))

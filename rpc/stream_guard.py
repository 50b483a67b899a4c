"""Bounds on streaming calls: their number, and their time of waiting for a client.

A call occupies a worker of a synchronous server until it ends. Without bounds a client that opens a
few streams and sends nothing would occupy all workers.
"""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import grpc

from rpc.errors import RefusedError

POLL_S = 0.25
"""Interval of the check of calls in progress, s."""


class _Call:
    """One call in progress, with its time of waiting for the client."""

    def __init__(self, context: grpc.ServicerContext) -> None:
        self.context = context
        self.since: float | None = None
        self.waited = 0.0
        self.expired = False

    @contextmanager
    def waiting(self) -> Iterator[None]:
        """Count the time within as waiting for the client."""
        self.since = time.monotonic()
        try:
            yield
        finally:
            self.waited += time.monotonic() - self.since
            self.since = None


class StreamGuard:
    """Limits the number of streaming calls, and cancels those whose client is idle."""

    def __init__(
        self,
        limit: int,
        idle_s: float,
        total_s: float,
        on_full: Callable[[bool], None] = lambda full: None,
    ) -> None:
        """limit: most calls at a time. idle_s, total_s: longest wait for a client, once and in
        total. on_full: called with True when the limit is reached, with False afterwards."""
        self._limit, self._idle_s, self._total_s, self._on_full = limit, idle_s, total_s, on_full
        self._calls: set[_Call] = set()
        self._lock = threading.Lock()
        self._closed = threading.Event()
        self._watch: threading.Thread | None = None

    @contextmanager
    def call(self, context: grpc.ServicerContext) -> Iterator[_Call]:
        """Count a call while it runs; RefusedError beyond the limit."""
        one = _Call(context)
        with self._lock:
            refused = len(self._calls) >= self._limit
            if not refused:
                self._calls.add(one)
                if len(self._calls) == self._limit:
                    self._on_full(True)
                if self._watch is None:
                    self._watch = threading.Thread(target=self._poll, daemon=True)
                    self._watch.start()
        if refused:
            raise RefusedError(
                grpc.StatusCode.RESOURCE_EXHAUSTED,
                f"{self._limit} calls of many messages are in progress: try again",
            )
        try:
            yield one
        finally:
            with self._lock:
                if len(self._calls) == self._limit and not self._closed.is_set():
                    self._on_full(False)
                self._calls.discard(one)

    def requests(self, messages: Iterator[Any], one: _Call) -> Iterator[Any]:
        """Messages of the client; waiting for them is timed."""
        while True:
            with one.waiting():
                try:
                    message = next(messages)
                except StopIteration:
                    return
            yield message

    def responses(self, messages: Iterator[Any], one: _Call) -> Iterator[Any]:
        """Messages of the service; the client's time to read them is timed."""
        for message in messages:
            with one.waiting():
                yield message

    def close(self) -> None:
        """End the check of calls."""
        self._closed.set()

    def _poll(self) -> None:
        while not self._closed.wait(POLL_S):
            now = time.monotonic()
            with self._lock:
                calls = tuple(self._calls)
            for one in calls:
                since = one.since
                if since is None or one.expired:
                    continue
                idle = now - since
                if idle > self._idle_s or one.waited + idle > self._total_s:
                    one.expired = True
                    one.context.cancel()

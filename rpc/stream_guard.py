"""Calls of many messages within bounds: how many at a time, and how long they wait for a client.

A worker of a synchronous server belongs to its call until that ends. A client that opens a few
streams and says nothing would otherwise hold all of them.
"""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import grpc

from rpc.errors import RefusedError

LOOK_S = 0.25
"""Between two looks at the calls in progress."""


class _Call:
    """One call in progress: how long it has waited for its client."""

    def __init__(self, context: grpc.ServicerContext) -> None:
        self.context = context
        self.since: float | None = None
        self.waited = 0.0
        self.expired = False

    @contextmanager
    def waiting(self) -> Iterator[None]:
        """Within it, the client is waited for."""
        self.since = time.monotonic()
        try:
            yield
        finally:
            self.waited += time.monotonic() - self.since
            self.since = None


class StreamGuard:
    """Counts the calls of many messages, and ends those whose client keeps them waiting."""

    def __init__(
        self,
        most: int,
        idle_s: float,
        total_s: float,
        full: Callable[[bool], None] = lambda full: None,
    ) -> None:
        """`most`: calls at a time; `idle_s`, `total_s`: what one waits for its client, at a time
        and in all; `full`: told when no more are taken, and when there are again."""
        self._most, self._idle_s, self._total_s, self._told = most, idle_s, total_s, full
        self._calls: set[_Call] = set()
        self._lock = threading.Lock()
        self._closed = threading.Event()
        self._watch: threading.Thread | None = None

    @contextmanager
    def call(self, context: grpc.ServicerContext) -> Iterator[_Call]:
        """Within it, the call is counted; RefusedError where there are too many."""
        one = _Call(context)
        with self._lock:
            refused = len(self._calls) >= self._most
            if not refused:
                self._calls.add(one)
                if len(self._calls) == self._most:
                    self._told(True)
                if self._watch is None:
                    self._watch = threading.Thread(target=self._look, daemon=True)
                    self._watch.start()
        if refused:
            raise RefusedError(
                grpc.StatusCode.RESOURCE_EXHAUSTED,
                f"{self._most} calls of many messages are in progress: try again",
            )
        try:
            yield one
        finally:
            with self._lock:
                if len(self._calls) == self._most and not self._closed.is_set():
                    self._told(False)
                self._calls.discard(one)

    def requests(self, messages: Iterator[Any], one: _Call) -> Iterator[Any]:
        """A client's messages as they come."""
        while True:
            with one.waiting():
                try:
                    message = next(messages)
                except StopIteration:
                    return
            yield message

    def responses(self, messages: Iterator[Any], one: _Call) -> Iterator[Any]:
        """A service's messages as the client takes them."""
        for message in messages:
            with one.waiting():
                yield message

    def close(self) -> None:
        """Watch no more."""
        self._closed.set()

    def _look(self) -> None:
        while not self._closed.wait(LOOK_S):
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

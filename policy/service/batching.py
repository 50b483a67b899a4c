"""Batching of concurrent requests into one forward pass."""

import asyncio
import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import torch
from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram
from torch import Tensor

from policy.checkpoints.served import ACTIONS, STATE_WIDTH, Served
from policy.config import BatchConfig
from policy.errors import BusyError, RequestError
from policy.objects.columns import POSE_WIDTH
from policy.service.batch_size import BatchSizePredictor
from policy.service.poses import observations
from world.character.features import STATE, Table

_FLOAT = np.dtype("<f4")
SMALL_ROWS = 16
"""Most rows of a small request; larger ones have a queue of their own."""
PART_ROWS = 32
"""Rows of a large request in one forward pass, which takes half a millisecond."""
TURNS = 8
"""Turns of the event loop between two parts of large requests. In one turn gRPC hands over a single
message, so with one turn a part the messages of other clients would pile up."""
_ROW = ACTIONS * _FLOAT.itemsize


class Answer(NamedTuple):
    """Result of a request."""

    action: bytes
    """[rows, 28] float32."""
    target: bytes
    """[rows, 28] float32: set-points, rad."""
    version: str


class Entry(NamedTuple):
    """A queued request."""

    rows: int
    data: bytes
    """[rows, width] float32: (state, goal) or, where `posed`, pose rows of policy.service.poses."""
    posed: bool
    noise: np.ndarray | None
    """[rows, 28] standard normal; None: the mean action."""
    answer: "asyncio.Future[Answer]"
    since: float
    first: int = 0
    """Number of the first row in its call, for messages."""


class BatchMetrics:
    """Metrics of the batchers of a service."""

    def __init__(self, registry: CollectorRegistry) -> None:
        label = ["policy"]
        sizes = [1, 2, 4, 8, 16, 32, 64, 128, 256]
        self.rows = Histogram(
            "policy_batch_rows", "Rows of a forward pass.", label, registry=registry, buckets=sizes
        )
        self.queued = Gauge("policy_queued_rows", "Rows waiting.", label, registry=registry)
        self.refused = Counter(
            "policy_refused", "Requests refused because the queue was full.", label,
            registry=registry,
        )  # fmt: skip
        waits = [1e-4, 2.5e-4, 5e-4, 1e-3, 2e-3, 4e-3, 8e-3, 16e-3, 32e-3, 0.1]
        self.wait = Histogram(
            "policy_wait_seconds", "Wait of a batch's first request, its computation included.",
            label, registry=registry, buckets=waits,
        )  # fmt: skip


class Batcher:
    """Request queue of one policy, on one event loop."""

    def __init__(
        self, served: Callable[[], Served], config: BatchConfig, metrics: BatchMetrics
    ) -> None:
        """served: returns the version to act with; called once per batch."""
        self._served, self._config = served, config
        self._waiting: deque[Entry] = deque()
        #: Large requests have their own queue, so that they do not delay the small ones.
        self._large: deque[Entry] = deque()
        self._large_next = False
        self._rows = self._large_rows = 0
        self._timer: asyncio.Handle | None = None
        self._soon = False
        #: Open streams and calls in progress. When each of them has a queued request and no further
        #: calls are expected, the batch does not wait.
        self.streams = self.calls = 0
        self._predictor = BatchSizePredictor()
        name = served().name
        self._batch_rows, self._queued = metrics.rows.labels(name), metrics.queued.labels(name)
        self._refused, self._wait = metrics.refused.labels(name), metrics.wait.labels(name)

    @property
    def queued_rows(self) -> int:
        """Number of rows in the queue."""
        return self._rows

    def submit(
        self, data: bytes, rows: int, posed: bool, noise: np.ndarray | None, first: int = 0
    ) -> "asyncio.Future[Answer]":
        """Future answer to a request (fields as in Entry); BusyError where the queue is full."""
        queue = self._large if rows > SMALL_ROWS else self._waiting
        # each queue has room of its own: large requests never keep a character's frame out
        waiting = self._large_rows if queue is self._large else self._rows - self._large_rows
        if waiting + rows > self._config.max_queued_rows:
            self._refused.inc()
            raise BusyError(
                f"{waiting} rows are waiting and at most {self._config.max_queued_rows} may: "
                "ask for fewer at a time, or later"
            )
        loop = asyncio.get_running_loop()
        answer: asyncio.Future[Answer] = loop.create_future()
        queue.append(Entry(rows, data, posed, noise, answer, time.monotonic(), first))
        self._rows += rows
        self._large_rows += rows if queue is self._large else 0
        full = self._rows >= self._config.max_rows or self._complete()
        if full and not self._soon:
            # not at once, so that requests that have already arrived join the batch
            self._cancel_timer()
            self._soon = True
            loop.call_soon(self._flush)
        elif not full and self._timer is None and not self._soon:
            self._timer = loop.call_later(self._config.max_wait_s, self._flush)
        return answer

    def _complete(self) -> bool:
        """Whether no further request is expected."""
        if len(self._waiting) + len(self._large) < self.streams + self.calls:
            return False
        return not (self.calls and self._predictor.expects_more_than(self.calls))

    def _cancel_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _flush(self) -> None:
        """Run one forward pass for the requests that have waited longest."""
        self._cancel_timer()
        self._soon = False
        if self.calls:
            self._predictor.observe(self.calls)
        batch: list[Entry] = []
        rows = 0
        # in turn, so that each queue waits for at most one pass of the other
        first, second = self._waiting, self._large
        if self._large_next:
            first, second = second, first
        self._large_next = not self._large_next
        for queue in (first, second):
            most = PART_ROWS if queue is self._large else self._config.max_rows
            while queue and (not batch or rows + queue[0].rows <= most):
                entry = queue.popleft()
                self._rows -= entry.rows
                self._large_rows -= entry.rows if queue is self._large else 0
                if not entry.answer.done():  # its call may be cancelled or past its deadline
                    batch.append(entry)
                    rows += entry.rows
        if self._waiting or self._large:
            self._soon = True
            # a client that is alone need not wait for others
            shared = self.streams or self.calls > 1
            self._turn(TURNS if shared and not self._waiting else 0)
        if not batch:
            return
        try:
            self._answer(batch)
        except Exception as error:
            for entry in batch:
                if not entry.answer.done():
                    entry.answer.set_exception(error)
        self._batch_rows.observe(rows)
        self._queued.set(self._rows)
        self._wait.observe(time.monotonic() - batch[0].since)

    def _turn(self, left: int) -> None:
        """Flush after so many turns of the loop, or as soon as a small request waits."""
        loop = asyncio.get_running_loop()
        if left and not self._waiting:
            loop.call_soon(self._turn, left - 1)
        else:
            loop.call_soon(self._flush)

    def _answer(self, batch: list[Entry]) -> None:
        served = self._served()
        raw = [entry for entry in batch if not entry.posed]
        posed = [entry for entry in batch if entry.posed]
        parts: list[Tensor] = []
        if raw:
            rows = _tensor(raw, served.width)
            if not np.isfinite(rows).all():
                raw = _refused(raw, rows, served)
                rows = _tensor(raw, served.width)
            parts.append(torch.from_numpy(rows))
        if posed:
            parts.append(observations(torch.from_numpy(_tensor(posed, POSE_WIDTH)), served.task))
        entries = raw + posed
        if not entries:
            return
        observation = parts[0] if len(parts) == 1 else torch.cat(parts)
        action = served.act(observation)
        if any(entry.noise is not None for entry in entries):
            noise = [
                np.zeros((entry.rows, ACTIONS), _FLOAT) if entry.noise is None else entry.noise
                for entry in entries
            ]
            action = action + served.sigma * torch.from_numpy(np.concatenate(noise))
        targets = served.action_map.set_points(action).numpy().tobytes()
        actions = action.numpy().tobytes()
        version, start = served.version, 0
        for entry in entries:
            end = start + entry.rows * _ROW
            entry.answer.set_result(Answer(actions[start:end], targets[start:end], version))
            start = end


async def turns() -> None:
    """Give the other clients their turns, after a part of a large request."""
    for _ in range(TURNS):
        await asyncio.sleep(0)


def _tensor(entries: list[Entry], width: int) -> np.ndarray:
    """Rows [n, width] of all entries, float32 and writable."""
    data = bytearray().join([entry.data for entry in entries])
    return np.frombuffer(data, _FLOAT).reshape(-1, width)


def _refused(entries: list[Entry], rows: np.ndarray, served: Served) -> list[Entry]:
    """Entries whose rows are finite; the others get a RequestError."""
    finite, start = [], 0
    for entry in entries:
        own = rows[start : start + entry.rows]
        start += entry.rows
        wrong = np.argwhere(~np.isfinite(own))
        if not len(wrong):
            finite.append(entry)
            continue
        row, column = (int(i) for i in wrong[0])
        table, field = STATE, "state"
        if column >= STATE_WIDTH:
            table, field, column = served.task.goal, "goal", column - STATE_WIDTH
        feature, at = _feature(table, column)
        entry.answer.set_exception(
            RequestError(
                f"{field}: row {entry.first + row}, number {column} ({feature}[{at}]) is "
                f"{own[row, column + (STATE_WIDTH if field == 'goal' else 0)]}, must be finite"
            )
        )
    return finite


def _feature(table: Table, column: int) -> tuple[str, int]:
    """Name of the feature that a column belongs to, and the column's index in it."""
    for feature in table:
        part = table.slice(feature.name)
        if part.start <= column < part.stop:
            return feature.name, column - part.start
    raise AssertionError(column)

"""Policies that follow their checkpoints: a better one replaces what is served, a bad one never."""

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from prometheus_client import CollectorRegistry, Counter

from policy.checkpoints.background import run_in_background
from policy.checkpoints.served import Served
from world.errors import InhabitError

SLOW_S = 30.0
"""A look at a checkpoint that takes longer is said."""
Signature = tuple[str, int, int, int]


@dataclass(frozen=True)
class Source:
    """Where a policy comes from, and how it is read."""

    name: str
    find: Callable[[], Path]
    """The checkpoint to serve now; InhabitError where there is none."""
    load: Callable[[Path], Served]
    """Reads and verifies it; InhabitError where it cannot be served."""


class Follower:
    """The version of one policy that is served, and the watch over its checkpoint."""

    def __init__(self, source: Source, say: Callable[[str], None] | None = None) -> None:
        """Load the first version.

        say: gets one line for every reload and refusal. Raises InhabitError where the first cannot
        be served.
        """
        self.source = source
        self._say = say or (lambda line: None)
        path = source.find()
        self._seen = signature(path)
        self.served = source.load(path).check()
        self.reloads = 0
        self.last_refusal = ""
        self._poll: asyncio.Future[bool] | None = None
        self._began = 0.0
        self._reloads: Counter | None = None
        self._refusals: Counter | None = None

    def observe(self, reloads: Counter, refusals: Counter) -> None:
        """Count among the service's metrics."""
        self._reloads, self._refusals = reloads, refusals

    async def poll(self) -> bool:
        """Look for another checkpoint and take it if it can be served; whether it was taken.

        Reading goes on beside the serving. Whatever goes wrong, the present version stays.
        """
        try:
            path, seen = await run_in_background(self._look)
        except InhabitError as error:
            return self._refuse(str(error))
        except OSError as error:
            return self._refuse(f"{error.filename}: {error.strerror}")
        if seen == self._seen:
            return False
        self._seen = seen
        try:
            served = await run_in_background(self._read, path)
        except InhabitError as error:
            return self._refuse(str(error))
        except Exception as error:  # a foreign file may fail in any way; the service goes on
            return self._refuse(f"{path}: {type(error).__name__}: {error}")
        if served.digest == self.served.digest:
            self.last_refusal = ""
            return False
        self._say(f"{self.source.name}: {self.served.version} -> {served.version} ({path})")
        self.served, self.last_refusal = served, ""
        self.reloads += 1
        if self._reloads is not None:
            self._reloads.inc()
        return True

    def watch(self) -> None:
        """Poll, on a task of its own, unless the last poll still goes on: a disk that hangs keeps
        nothing else from being served, reloaded or ended."""
        now = time.monotonic()
        if self._poll is not None and not self._poll.done():
            if now - self._began > SLOW_S:
                self._refuse(f"its checkpoint is not read for {SLOW_S:g} s: is its disk there?")
            return
        self._began = now
        self._poll = asyncio.ensure_future(self.poll())

    def close(self) -> None:
        """Wait for no poll any more."""
        if self._poll is not None:
            self._poll.cancel()

    def _look(self) -> tuple[Path, Signature]:
        path = self.source.find()
        return path, signature(path)

    def _read(self, path: Path) -> Served:
        served = self.source.load(path).check()
        ours, theirs = self.served.task.name, served.task.name
        if ours != theirs:
            raise InhabitError(f"{path}: a policy of task '{theirs}', this one is of '{ours}'")
        return served

    def _refuse(self, why: str) -> bool:
        if why != self.last_refusal:
            self.last_refusal = why
            self._say(f"{self.source.name}: still serving {self.served.version}: {why}")
            if self._refusals is not None:
                self._refusals.inc()
        return False


def signature(path: Path) -> Signature:
    """Changes when a checkpoint does, without reading it; OSError where there is none."""
    manifest = path / "manifest.json"
    status = manifest.stat()
    return str(path.resolve()), status.st_mtime_ns, status.st_ino, status.st_size


def counters(registry: CollectorRegistry) -> tuple[Counter, Counter]:
    """(reloads, refused reloads), by policy."""
    return (
        Counter("policy_reloads", "Checkpoints taken.", ["policy"], registry=registry),
        Counter("policy_refused_reloads", "Checkpoints refused.", ["policy"], registry=registry),
    )

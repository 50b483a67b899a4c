"""Reload of served policies: a new valid checkpoint replaces the served version."""

import asyncio
import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from prometheus_client import CollectorRegistry, Counter

from policy.checkpoints.background import run_in_background
from policy.checkpoints.served import Served
from world.errors import InhabitError

SLOW_S = 30.0
"""Duration of a poll beyond which it is reported as slow, s."""
Signature = tuple[str, int, int, int]
"""Path, modification time (ns), inode and size of a manifest."""


@dataclass(frozen=True)
class Source:
    """Name of a policy, and functions that find and load its checkpoint."""

    name: str
    find: Callable[[], Path]
    """Returns the checkpoint to serve now; raises InhabitError where there is none."""
    load: Callable[[Path], Served]
    """Reads and verifies a checkpoint; raises InhabitError where it cannot be served."""


class Follower:
    """The served version of one policy, replaced when its checkpoint changes."""

    def __init__(self, source: Source, report: Callable[[str], None] | None = None) -> None:
        """Load the first version.

        report: called with one line for every reload and refusal.
        Raises InhabitError where the first version cannot be served.
        """
        self.source = source
        self._report = report or (lambda line: None)
        path = source.find()
        self._signature = signature(path)
        self.served = source.load(path).check()
        self.reloads = 0
        self.last_refusal = ""
        self._poll: asyncio.Future[bool] | None = None
        self._refused = False
        """Whether the files of `_signature` are not served"""
        self._began = 0.0
        self._reloads: Counter | None = None
        self._refusals: Counter | None = None

    def observe(self, reloads: Counter, refusals: Counter) -> None:
        """Count reloads and refusals in these metrics."""
        self._reloads, self._refusals = reloads, refusals

    async def poll(self) -> bool:
        """Load a changed checkpoint if it can be served; returns whether it replaced the version.

        The files are read on another thread. After any error the present version stays.
        """
        try:
            path, found = await run_in_background(self._find)
        except InhabitError as error:
            return self._refuse(str(error))
        except OSError as error:
            return self._refuse(f"{error.filename}: {error.strerror}")
        if found == self._signature:
            if not self._refused:
                self.last_refusal = ""  # what could not be read for a while is there again
            return False
        try:
            served = await run_in_background(self._read, path)
        except Exception as error:  # a foreign file may fail in any way; the service must go on
            if not isinstance(error.__cause__ or error, OSError):
                self._signature, self._refused = found, True
            # else the next poll reads it again: a disk may fail for a moment
            known = isinstance(error, InhabitError)
            return self._refuse(str(error) if known else f"{path}: {type(error).__name__}: {error}")
        self._signature, self._refused = found, False
        if served.digest == self.served.digest:
            self.last_refusal = ""
            return False
        before, self.served, self.last_refusal = self.served, served, ""
        self._tell(f"{self.source.name}: {before.version} -> {served.version} ({path})")
        self.reloads += 1
        if self._reloads is not None:
            self._reloads.inc()
        return True

    def watch(self) -> None:
        """Poll in a task of its own, unless the last poll still runs: a disk that hangs delays
        neither serving nor other reloads nor the end."""
        now = time.monotonic()
        if self._poll is not None and not self._poll.done():
            if now - self._began > SLOW_S:
                self._refuse(f"its checkpoint is not read for {SLOW_S:g} s: is its disk there?")
            return
        self._began = now
        self._poll = asyncio.ensure_future(self.poll())

    def close(self) -> None:
        """Cancel a poll that runs."""
        if self._poll is not None:
            self._poll.cancel()

    def _find(self) -> tuple[Path, Signature]:
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
            self._tell(f"{self.source.name}: still serving {self.served.version}: {why}")
            if self._refusals is not None:
                self._refusals.inc()
        return False

    def _tell(self, line: str) -> None:
        """Report a line; that nobody reads them any more, must not end the reloads."""
        with contextlib.suppress(OSError):
            self._report(line)


def signature(path: Path) -> Signature:
    """Signature of a checkpoint, which changes when it is replaced; OSError without a manifest."""
    manifest = path / "manifest.json"
    status = manifest.stat()
    return str(path.resolve()), status.st_mtime_ns, status.st_ino, status.st_size


def counters(registry: CollectorRegistry) -> tuple[Counter, Counter]:
    """Counters of reloads and of refused reloads, by policy."""
    return (
        Counter("policy_reloads", "Checkpoints taken.", ["policy"], registry=registry),
        Counter("policy_refused_reloads", "Checkpoints refused.", ["policy"], registry=registry),
    )

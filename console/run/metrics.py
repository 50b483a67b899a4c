"""Metric sinks: JSON lines as the record, TensorBoard beside it."""

import io
import json
import math
import os
import socket
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

from console.run.directory import RunDirectory, RunError, write_text
from console.run.renamed import current_metrics


class Recorder(Protocol):
    """Takes one flat dict "group/name" -> number an iteration."""

    def write(self, metrics: Mapping[str, float]) -> None: ...

    def close(self) -> None: ...


class JsonLines:
    """Appends one line an iteration to metrics.jsonl; each line is whole or absent."""

    def __init__(self, path: Path) -> None:
        self._path = path
        with _writing(path):
            self._file = path.open("ab", buffering=0)

    def write(self, metrics: Mapping[str, float]) -> None:
        line = json.dumps({k: plain(v) for k, v in metrics.items()}) + "\n"
        with _writing(self._path):
            if not os.fstat(self._file.fileno()).st_nlink:
                # the open file would take lines that nobody will ever read
                raise RunError(f"{self._path} was deleted while the run was going on: it ends here")
            _append(self._file, line.encode())

    def close(self) -> None:
        self._file.close()


class TensorBoard:
    """The same figures as TensorBoard scalars over samples.

    Written at once: the usual writer's thread would tell of a full disk in a traceback, later.
    """

    def __init__(self, folder: Path, purge_step: int | None = None) -> None:
        # half a second that --help can do without
        from tensorboard.compat.proto.event_pb2 import Event, SessionLog
        from tensorboard.compat.proto.summary_pb2 import Summary
        from tensorboard.summary.writer.record_writer import RecordWriter

        self._event, self._summary, self._record_writer = Event, Summary, RecordWriter
        self._folder = folder
        name = f"events.out.tfevents.{time.time():017.6f}.{socket.gethostname()}.{os.getpid()}"
        with _writing(folder):
            self._file = (folder / name).open("ab", buffering=0)
        self._append(file_version="brain.Event:2")
        if purge_step is not None:
            self._append(step=purge_step, session_log=SessionLog(status=SessionLog.START))

    def write(self, metrics: Mapping[str, float]) -> None:
        values = [
            self._summary.Value(tag=name, simple_value=value)
            for name, value in metrics.items()
            if name not in ("iteration", "samples") and math.isfinite(value)
        ]
        self._append(step=int(metrics.get("samples", 0)), summary=self._summary(value=values))

    def _append(self, **content: Any) -> None:
        record = io.BytesIO()
        event = self._event(wall_time=time.time(), **content)
        self._record_writer(record).write(event.SerializeToString())
        with _writing(self._folder):
            _append(self._file, record.getvalue())

    def close(self) -> None:
        self._file.close()


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise RunError(f"cannot write {path}: {error.strerror}") from error


def _append(file: io.FileIO, data: bytes) -> None:
    """Append all of it or nothing; OSError where the disk is full."""
    end = file.seek(0, os.SEEK_END)
    try:
        written = 0
        while written < len(data):
            written += file.write(data[written:])
    except OSError:
        file.truncate(end)
        raise


def plain(value: Any) -> float | int | None:
    """A number that JSON can hold: NaN and infinities become null."""
    number = value.item() if hasattr(value, "item") else value
    if isinstance(number, bool | int):
        return int(number)
    return float(number) if math.isfinite(number) else None


def open_recorders(run: RunDirectory, samples: int) -> list[Recorder]:
    """The sinks of one run, continuing after `samples` control steps."""
    purge = samples + 1 if samples else None
    return [JsonLines(run.metrics), TensorBoard(run.tensorboard, purge)]


def read_metrics(path: Path) -> list[dict[str, Any]]:
    """Every whole line of a metrics file; one that is damaged or cut short is left out alone."""
    return [current_metrics(line) for line in map(_parsed, _lines(path)) if line is not None]


def truncate_metrics(path: Path, iteration: int) -> int:
    """Drop lines beyond `iteration`, which a resumed run will write again; returns how many.

    Damaged lines go, too. The others stay as they are written.
    """
    texts = _lines(path)
    parsed = [_parsed(text) for text in texts]
    kept = [
        text
        for text, line in zip(texts, parsed, strict=True)
        if line is not None and line["iteration"] <= iteration
    ]
    if len(kept) < len(texts):
        write_text(path, "".join(text + "\n" for text in kept))
    return sum(line is not None for line in parsed) - len(kept)


def _lines(path: Path) -> list[str]:
    try:
        text = path.read_bytes().decode("utf-8", "replace")
    except FileNotFoundError:
        return []
    except OSError as error:
        raise RunError(f"cannot read {path}: {error.strerror}") from error
    return [line for line in text.split("\n") if line.strip()]


def _parsed(text: str) -> dict[str, Any] | None:
    """An iteration's figures: a flat object of numbers; None where the line is none."""
    try:
        line = json.loads(text)
    except (ValueError, RecursionError):
        return None
    if not isinstance(line, dict) or type(line.get("iteration")) is not int:
        return None
    numbers = all(value is None or isinstance(value, int | float) for value in line.values())
    return line if numbers else None

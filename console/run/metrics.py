"""Metric recorders, JSON lines and TensorBoard, and the reader of the JSON lines."""

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
    """Records one flat dict "group/name" -> number per iteration."""

    def write(self, metrics: Mapping[str, float]) -> None: ...

    def close(self) -> None: ...


class JsonLines:
    """Appends one line per iteration to metrics.jsonl; each line is whole or absent."""

    def __init__(self, path: Path) -> None:
        self._path = path
        with _writing(path):
            self._file = path.open("ab", buffering=0)

    def write(self, metrics: Mapping[str, float]) -> None:
        line = json.dumps({k: plain(v) for k, v in metrics.items()}) + "\n"
        with _writing(self._path):
            if not os.fstat(self._file.fileno()).st_nlink:
                # lines written to a deleted file are lost
                raise RunError(f"{self._path} was deleted during the run: training stops")
            _append(self._file, line.encode())

    def close(self) -> None:
        self._file.close()


class TensorBoard:
    """Writes the same figures as TensorBoard scalars over samples.

    Events are written synchronously: the thread of TensorBoard's own writer reports a full disk
    late and with a traceback.
    """

    def __init__(self, folder: Path, purge_step: int | None = None) -> None:
        # imported here: it takes half a second, which --help does not need
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
    """Append all data or none; OSError for a full disk."""
    end = file.seek(0, os.SEEK_END)
    try:
        written = 0
        while written < len(data):
            written += file.write(data[written:])
    except OSError:
        file.truncate(end)
        raise


def plain(value: Any) -> float | int | None:
    """Return a number as a JSON value: NaN and infinities become null."""
    number = value.item() if hasattr(value, "item") else value
    if isinstance(number, bool | int):
        return int(number)
    return float(number) if math.isfinite(number) else None


def open_recorders(run: RunDirectory, samples: int) -> list[Recorder]:
    """Return the recorders of one run, which continues after `samples` control steps."""
    purge = samples + 1 if samples else None
    return [JsonLines(run.metrics), TensorBoard(run.tensorboard, purge)]


def read_metrics(path: Path) -> list[dict[str, Any]]:
    """Return all valid lines of a metrics file; damaged or truncated lines are left out."""
    return [current_metrics(line) for line in map(_parsed, _lines(path)) if line is not None]


def truncate_metrics(path: Path, iteration: int) -> int:
    """Drop the lines after `iteration`, which a resumed run writes again; return their number.

    Damaged lines are dropped too. The others stay unchanged.
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
    """Return an iteration's figures, a flat object of numbers; None for an invalid line."""
    try:
        line = json.loads(text)
    except (ValueError, RecursionError):
        return None
    if not isinstance(line, dict) or type(line.get("iteration")) is not int:
        return None
    numbers = all(value is None or isinstance(value, int | float) for value in line.values())
    return line if numbers else None

"""Metric sinks: JSON lines as the record, TensorBoard beside it."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

from console.runs import RunDirectory, RunError, write_text


class Recorder(Protocol):
    """Takes one flat dict "group/name" -> number an iteration."""

    def write(self, metrics: Mapping[str, float]) -> None: ...

    def close(self) -> None: ...


class JsonLines:
    """Appends one line an iteration to metrics.jsonl; each line is whole or absent."""

    def __init__(self, path: Path) -> None:
        try:
            self._file = path.open("a", buffering=1)
        except OSError as error:
            raise RunError(f"cannot write {path}: {error.strerror}") from error
        self._path = path

    def write(self, metrics: Mapping[str, float]) -> None:
        try:
            self._file.write(json.dumps({k: plain(v) for k, v in metrics.items()}) + "\n")
        except OSError as error:
            raise RunError(f"cannot write {self._path}: {error.strerror}") from error

    def close(self) -> None:
        self._file.close()


class TensorBoard:
    """The same figures as TensorBoard scalars over samples."""

    def __init__(self, folder: Path, purge_step: int | None = None) -> None:
        from torch.utils.tensorboard import (
            SummaryWriter,
        )  # half a second that --help can do without

        self._writer = SummaryWriter(str(folder), purge_step=purge_step)

    def write(self, metrics: Mapping[str, float]) -> None:
        step = int(metrics.get("samples", 0))
        for name, value in metrics.items():
            if name not in ("iteration", "samples") and math.isfinite(value):
                self._writer.add_scalar(name, value, step)

    def close(self) -> None:
        self._writer.close()


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
    """Every whole line of a metrics file; a last line cut short by a crash is left out."""
    lines: list[dict[str, Any]] = []
    if not path.exists():
        return lines
    for text in path.read_text().splitlines():
        try:
            lines.append(json.loads(text))
        except json.JSONDecodeError:
            break
    return lines


def truncate_metrics(path: Path, iteration: int) -> int:
    """Drop lines beyond `iteration`, which a resumed run will write again; returns how many."""
    lines = read_metrics(path)
    kept = [line for line in lines if line.get("iteration", 0) <= iteration]
    if path.exists():
        write_text(path, "".join(json.dumps(line) + "\n" for line in kept))
    return len(lines) - len(kept)

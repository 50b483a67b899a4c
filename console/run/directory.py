"""The run directory: its name, lock, files, and the choice of a checkpoint."""

import datetime
import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pretrained
from policy.checkpoints.numbering import numbered
from world.errors import ConfigError, InhabitError
from world.partial_files import locked, replacing
from world.placeholders import read_bounded

MAX_CONFIG_BYTES = 1 << 24

RUNS = Path("runs")


class RunError(InhabitError):
    """A run directory that exists, is missing, is in use, or lacks a requested file."""


@dataclass(frozen=True)
class RunDirectory:
    """Paths of one run; the names are fixed, because other programs read them."""

    path: Path

    @property
    def config(self) -> Path:
        return self.path / "config.json"

    @property
    def metrics(self) -> Path:
        return self.path / "metrics.jsonl"

    @property
    def tensorboard(self) -> Path:
        return self.path / "tensorboard"

    @property
    def checkpoints(self) -> Path:
        return self.path / "checkpoints"

    @property
    def evaluations(self) -> Path:
        return self.path / "evaluations"

    @property
    def recordings(self) -> Path:
        return self.path / "recordings"

    @property
    def before(self) -> Path:
        """Runs of a recipe that are made before this one."""
        return self.path / "before"

    def create(self) -> None:
        """Make the directory and its folders; RunError where that fails."""
        try:
            for folder in (self.path, self.tensorboard, self.checkpoints, self.evaluations):
                folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RunError(f"cannot make run directory {self.path}: {error.strerror}") from error

    def erase(self) -> None:
        """Remove the files of a run, for --restart; files of other names stay."""
        folders = (self.tensorboard, self.checkpoints, self.evaluations, self.recordings)
        for folder in (*folders, self.before):
            shutil.rmtree(folder, ignore_errors=True)
        for file in (self.config, self.metrics):
            file.unlink(missing_ok=True)

    @property
    def occupied(self) -> bool:
        """True if the directory holds a run."""
        return self.config.exists() or self.metrics.exists() or any(self.checkpoints.glob("*"))

    def read_config(self) -> dict[str, Any]:
        """Return config.json as a dict; RunError if missing or not JSON."""
        try:
            content = json.loads(read_bounded(self.config, MAX_CONFIG_BYTES))
        except FileNotFoundError:
            raise RunError(f"{self.path} holds no config.json: it is not a run") from None
        except OSError as error:
            raise RunError(f"cannot read {self.config}: {error.strerror}") from error
        except (ValueError, RecursionError) as error:
            raise RunError(f"{self.config} is not valid JSON ({error}): restore it") from error
        if not isinstance(content, dict):
            raise RunError(f"{self.config} holds no object of settings: restore it")
        return content

    def write_config(self, config: dict[str, Any]) -> None:
        write_json(self.config, config)

    @contextmanager
    def lock(self) -> Iterator[None]:
        """Lock the run for this process, against a second training in the same directory."""
        self.path.mkdir(parents=True, exist_ok=True)
        if (handle := locked(self.path)) is None:
            raise RunError(
                f"{self.path} is in use by another process: stop it, or name another --run"
            )
        try:
            yield
        finally:
            os.close(handle)


def write_json(path: Path, value: Any) -> None:
    """Write JSON as `write_text` does."""
    write_text(path, json.dumps(value, indent=2) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write a file atomically: a reader sees the old or the new content.

    Raises RunError for a disk that is full or not writable; the old file stays.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as partial:
            partial.write_text(text, encoding="utf-8")
    except OSError as error:
        raise RunError(f"cannot write {path}: {error.strerror}") from error


def new_run(task: str, root: Path = RUNS, today: datetime.date | None = None) -> RunDirectory:
    """Return the next free runs/TASK-<date>-<n>."""
    day = (today or datetime.date.today()).isoformat()
    number = 1
    while (root / f"{task}-{day}-{number}").exists():
        number += 1
    return RunDirectory(root / f"{task}-{day}-{number}")


def policy_source(named: str) -> str:
    """Return a run or checkpoint as the absolute path of its checkpoint; the name of a policy, and
    "", unchanged. A training that resumes so has the weights with which it began.

    Raises ConfigError where there is none.
    """
    if not named:
        return named
    try:
        found = checkpoint_folder(Path(named))
    except RunError as error:
        raise ConfigError(str(error)) from None
    return str(found) if Path(named).exists() else named


def checkpoint_folder(where: Path) -> Path:
    """Return the checkpoint of a run directory, of a checkpoint folder, of `latest`/`best`, or of
    a policy's name.

    A run stands for its latest checkpoint. A folder with a manifest.json, such as
    `pretrained/TASK`, is a checkpoint itself. A path that does not exist may be the name of a
    policy of the package. Raises RunError without a checkpoint.
    """
    if not where.exists():
        named = pretrained.folder(str(where))
        if named is None:
            raise RunError(
                f"{where} does not exist: give a run directory, a checkpoint folder, or the name of"
                f" a policy: {', '.join(pretrained.names())}"
            )
        return named
    if where.is_file():
        raise RunError(f"{where} is a file: give a run directory or a checkpoint folder")
    if (where / "manifest.json").exists():
        return where.resolve()
    checkpoints = where / "checkpoints" if (where / "checkpoints").is_dir() else where
    for name in ("latest", "best"):
        if (checkpoints / name / "manifest.json").exists():
            return (checkpoints / name).resolve()
    for path in reversed(numbered(checkpoints)):
        if (path / "manifest.json").exists():
            return path.resolve()
    raise RunError(f"{where} holds no checkpoint: train longer, or give another run")


def run_of(checkpoint: Path) -> RunDirectory | None:
    """Return the run directory of a checkpoint folder; None for a standalone checkpoint."""
    if checkpoint.parent.name == "checkpoints":
        return RunDirectory(checkpoint.parent.parent)
    return None

"""The checkpoints of one run: the last few and the best, with `latest` and `best` by name."""

import os
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from policy.checkpoints.format import Checkpoint, Layout, Manifest, read, write
from policy.errors import CheckpointError, LayoutError

LATEST, BEST = "latest", "best"


class RunCheckpoints:
    """Writes `NNNNNN/` directories and keeps the last `keep`, the latest and the best of them."""

    def __init__(
        self,
        directory: Path,
        layout: Layout,
        notes: Mapping[str, str] | None = None,
        keep: int = 3,
        on_saved: Callable[[Path], None] | None = None,
    ) -> None:
        self.directory = directory
        self.layout = layout
        self.notes = dict(notes or {})
        self.keep = keep
        self.on_saved = on_saved

    def save(self, iteration: int, state: dict[str, Any], best: bool = False) -> None:
        """Write a checkpoint, move the names to it, and drop the oldest ones."""
        samples = int(state["training"]["learner"]["samples"])
        manifest = Manifest(self.layout, iteration, samples, self.notes)
        path = write(self.directory / f"{iteration:06d}", state, manifest)
        self._name(LATEST, path)
        if best:
            self._name(BEST, path)
        named = {self._named(name) for name in (LATEST, BEST)}
        for old in self.all()[: -self.keep]:
            if old not in named:
                shutil.rmtree(old, ignore_errors=True)
        if self.on_saved is not None:
            self.on_saved(path)

    def all(self) -> list[Path]:
        """Checkpoints, oldest first."""
        found = [p for p in self.directory.glob("[0-9]*") if p.is_dir()]
        return sorted(found, key=lambda p: int(p.name))

    def _named(self, name: str) -> Path | None:
        link = self.directory / name
        return self.directory / os.readlink(link) if link.is_symlink() else None

    def _name(self, name: str, path: Path) -> None:
        partial = self.directory / f".{name}.partial"
        try:
            partial.unlink(missing_ok=True)
            partial.symlink_to(path.name)
            partial.replace(self.directory / name)
        except OSError as error:
            raise CheckpointError(f"cannot name {path} '{name}': {error}") from error


def read_newest(directory: Path, layout: Layout) -> tuple[Checkpoint, list[str]]:
    """The latest checkpoint of a run that is whole, and a line about each newer one that is not.

    Raises the error of the latest one, CheckpointError or LayoutError, where none can be loaded.
    """
    numbered = sorted(directory.glob("[0-9]*"), key=lambda path: path.name, reverse=True)
    latest = directory / LATEST
    first = [latest.resolve()] if latest.exists() else []
    older = [path.resolve() for path in numbered if not first or path.name < first[0].name]
    errors: list[CheckpointError | LayoutError] = []
    for path in first + older:
        try:
            return read(path, layout=layout), [str(error) for error in errors]
        except (CheckpointError, LayoutError) as error:
            errors.append(error)
    if errors:
        raise errors[0]
    raise CheckpointError(f"{directory} holds no checkpoint")


def resolve(path: Path) -> Path:
    """A checkpoint directory from a run, a run's `checkpoints`, or a checkpoint: its latest."""
    for found in (path, path / LATEST, path / "checkpoints" / LATEST):
        if (found / "manifest.json").exists():
            return found.resolve()
    raise CheckpointError(
        f"{path} is neither a run with checkpoints nor a checkpoint, which holds a manifest.json"
    )

"""Checkpoints of one run: the last few and the best, with links `latest` and `best`."""

import os
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from policy.checkpoints.format import Checkpoint, Layout, Manifest, read, read_manifest, write
from policy.checkpoints.numbering import name_of, numbered
from policy.errors import CheckpointError, LayoutError
from world.partial_files import link, remove_leftovers

LATEST, BEST = "latest", "best"
#: Note of a checkpoint: samples before its stage, from which its schedules count; absent where 0.
STAGE_START = "stage_start"


class RunCheckpoints:
    """Writer of `NNNNNN/` directories that keeps the last `keep` of them and the best."""

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
        """Write a checkpoint, move `latest` (and `best`) to it, and remove old ones."""
        learner = state["training"]["learner"]
        samples, start = int(learner["samples"]), int(learner.get("stage_start", 0))
        notes = self.notes | ({STAGE_START: str(start)} if start else {})
        manifest = Manifest(self.layout, iteration, samples, notes)
        remove_leftovers(self.directory)
        path = write(self.directory / name_of(iteration), state, manifest)
        self._name(LATEST, path)
        if best:
            self._name(BEST, path)
        named = {self._named(name) for name in (LATEST, BEST)}
        for old in numbered(self.directory)[: -self.keep]:
            if old not in named:
                shutil.rmtree(old, ignore_errors=True)
        if self.on_saved is not None:
            self.on_saved(path)

    def _named(self, name: str) -> Path | None:
        link = self.directory / name
        return self.directory / os.readlink(link) if link.is_symlink() else None

    def _name(self, name: str, path: Path) -> None:
        try:
            link(self.directory / name, path.name)
        except OSError as error:
            raise CheckpointError(f"cannot name {path} '{name}': {error}") from error


def stage_samples(manifest: Manifest) -> int:
    """Samples of the stage that a checkpoint is in: where its schedules are."""
    start = str(manifest.notes.get(STAGE_START, ""))
    return manifest.samples - (int(start) if start.isdecimal() else 0)


def read_newest(
    directory: Path, layout: Callable[[Manifest], Layout]
) -> tuple[Checkpoint, list[str]]:
    """The latest intact checkpoint of a run, and the error line of each newer one.

    layout: the layout that a checkpoint with this manifest must have.

    Raises the error of the latest one, CheckpointError or LayoutError, where none can be loaded.
    """
    latest = directory / LATEST
    first = [latest.resolve()] if latest.exists() else []
    found = [path.resolve() for path in reversed(numbered(directory))]
    # newer ones than `latest`, if any, were not finished
    older = found[found.index(first[0]) + 1 :] if first and first[0] in found else found
    errors: list[CheckpointError | LayoutError] = []
    for path in first + older:
        try:
            found = read(path, layout=layout(read_manifest(path)))
            return found, [str(error) for error in errors]
        except (CheckpointError, LayoutError) as error:
            errors.append(error)
    if errors:
        raise errors[0]
    raise CheckpointError(f"{directory} holds no checkpoint")


def resolve(path: Path) -> Path:
    """Directory of the latest checkpoint of a run or of its `checkpoints`, or a checkpoint itself.

    Raises CheckpointError where the path is none of them.
    """
    for found in (path, path / LATEST, path / "checkpoints" / LATEST):
        if (found / "manifest.json").exists():
            return found.resolve()
    raise CheckpointError(
        f"{path} is neither a run with checkpoints nor a checkpoint, which holds a manifest.json"
    )

"""Imports many meshes: each in a process of its own with bounded time and memory, all cores busy,
what was made before taken from the cache."""

import contextlib
import hashlib
import json
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from world import bounded
from world.errors import PieceError
from world.furniture.piece import Piece
from world.meshes import notes, source, store, sweethome
from world.meshes.build import ImportOptions, build
from world.meshes.classes import CLASSES, category_of_names
from world.meshes.notes import Note
from world.refusals import refusing

CPU_S = 120
"""Processor time that one piece may take, s."""
WALL_S = 600
"""Time in all that one piece may take, s, however busy the machine."""
MEMORY_BYTES = 8 * 1024**3
"""Address space that one piece may take."""
ADVICE = "repair or decimate the mesh"
MAKER = 4
"""Number of the way pieces are made; a new one makes cached pieces again."""


@dataclass(frozen=True)
class Job:
    """One mesh to be made a piece of."""

    name: str
    file_name: str
    options: ImportOptions
    path: Path | None = None
    """Its file; None where `entry` has it."""
    entry: sweethome.Entry | None = None
    refused: str = ""
    """Why it cannot be tried at all."""


@dataclass(frozen=True)
class Outcome:
    """What became of a mesh."""

    name: str
    document: dict[str, Any] | None
    """The content of its piece's file, or None."""
    refused: str
    """Why there is none; empty otherwise."""
    cached: bool = False

    def piece(self) -> Piece | None:
        """The piece, if there is one."""
        return None if self.document is None else store.piece_of(self.document, self.name)


def cache_folder() -> Path:
    """$XDG_CACHE_HOME/inhabit/objects, or .cache/inhabit/objects in the user's home."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "inhabit" / "objects"


def jobs(paths: Sequence[Path], options: ImportOptions) -> list[Job]:
    """The meshes of files and folders, libraries opened. Raises PieceError for a path with none."""
    found: list[Job] = []
    for path in paths:
        if path.is_dir():
            files = sorted(p for p in path.rglob("*") if p.suffix.lower() in _READ)
            if not files:
                raise PieceError(f"{path}: no meshes; choose files of {', '.join(_READ)}")
            known = notes.of_folder(path)
            for file in files:
                found += _of_file(file, options, known.get(file.stem, Note()))
        elif path.exists():
            found += _of_file(path, options, notes.of_folder(path.parent).get(path.stem, Note()))
        else:
            raise PieceError(f"no such file or folder: {path}")
    return _distinct(found)


_READ = (*source.SUFFIXES, ".sh3f")


def run(
    work: Sequence[Job],
    workers: int,
    done: Callable[[Outcome], None] = lambda outcome: None,
    stopped: Callable[[], bool] = lambda: False,
) -> list[Outcome]:
    """What becomes of each job, in their order; `done` gets each as it ends.

    PieceError where `stopped` says so before all are done.
    """
    outcomes: dict[int, Outcome] = {}
    waiting: list[tuple[int, Job, str]] = []
    for index, job in enumerate(work):
        ready, digest = _known(job)
        if ready is None:
            waiting.append((index, job, digest))
        else:
            outcomes[index] = ready
            done(ready)
    for index, outcome in _processes(waiting, workers, stopped):
        outcomes[index] = outcome
        done(outcome)
    if len(outcomes) < len(work):
        raise PieceError("the import was given up")
    return [outcomes[index] for index in range(len(work))]


def make(job: Job, digest: str) -> dict[str, Any]:
    """The document of a job's piece. Raises InhabitError where it is none."""
    if job.entry is not None:
        mesh = sweethome.source(job.entry)
    elif job.path is not None:
        mesh = source.read(job.path)
    else:
        raise PieceError(f"{job.name}: nothing to read")
    options = replace(job.options, credit=job.options.credit or mesh.credit)
    return store.document(build(replace(mesh, name=job.name), options), digest, job.file_name)


def _of_file(path: Path, options: ImportOptions, note: Note) -> list[Job]:
    if path.suffix.lower() == ".sh3f":
        with refusing(PieceError, path, "library of furniture"):
            return _of_library(path, options)
    folder = path.parent.name.replace("_", "-").lower()
    category = options.category or (folder if folder in CLASSES else category_of_names(path.stem))
    licence = note.licence or options.licence
    credit = options.credit or note.credit
    own = replace(options, category=category, licence=licence, credit=credit)
    return [Job(_tidy(path.stem), path.name, own, path)]


def _of_library(path: Path, options: ImportOptions) -> list[Job]:
    """A library's furniture; what is none (a lamp, a door) is left out, not refused."""
    found = []
    for entry in sweethome.entries(path):
        category = (
            options.category or category_of_names(entry.title) or category_of_names(entry.name)
        )
        if category is None:
            continue
        licence = options.licence if options.licence != "unknown" else entry.licence or "unknown"
        own = replace(
            options,
            frame=entry.frame,
            category=category,
            licence=licence,
            credit=options.credit or entry.credit,
        )
        found.append(Job(_tidy(entry.name), path.name, own, None, entry, entry.refused))
    if not found:
        raise PieceError(f"{path.name}: no furniture of the classes {', '.join(CLASSES)} in it")
    return found


def _tidy(stem: str) -> str:
    kept = "".join(c if c.isalnum() else "-" for c in stem.lower())
    return "-".join(part for part in kept.split("-") if part) or "piece"


def _distinct(found: list[Job]) -> list[Job]:
    """The jobs, those of one name numbered."""
    seen: dict[str, int] = {}
    result = []
    for job in found:
        count = seen[job.name] = seen.get(job.name, 0) + 1
        result.append(job if count == 1 else replace(job, name=f"{job.name}-{count}"))
    return result


def _known(job: Job) -> tuple[Outcome | None, str]:
    """What is known without work, and the digest of what the piece would be made from."""
    if job.refused:
        return Outcome(job.name, None, job.refused), ""
    digest = hashlib.sha256()
    try:
        if job.entry is not None:
            digest.update(job.entry.content + repr(job.entry.rotation).encode())
        elif job.path is not None:
            with job.path.open("rb") as file:
                while chunk := file.read(1 << 20):
                    digest.update(chunk)
    except OSError as error:
        return Outcome(job.name, None, f"cannot read {job.path}: {error.strerror}"), ""
    content = digest.hexdigest()
    digest.update(json.dumps([MAKER, job.name, asdict(job.options)], default=str).encode())
    try:
        kept = store.read_document(_cached(digest.hexdigest()))
        store.piece_of(kept, job.name)
        return Outcome(job.name, kept, "", cached=True), ""
    except PieceError:
        return None, f"{digest.hexdigest()}:{content}"


def _cached(key: str) -> Path:
    return cache_folder() / f"{key}.json"


def _processes(
    waiting: list[tuple[int, Job, str]], workers: int, stopped: Callable[[], bool]
) -> Iterator[tuple[int, Outcome]]:
    """Outcomes of the jobs as they end, each made in a process of its own."""
    bounds = bounded.Bounds(CPU_S, WALL_S, MEMORY_BYTES)
    tasks = [bounded.Task(job.name, (job, digest), bounds) for _, job, digest in waiting]
    libraries = ("trimesh", "vhacdx", "scipy.spatial")
    for place, result in bounded.run(tasks, _made, workers, ADVICE, libraries, stopped):
        index, job, _ = waiting[place]
        yield index, Outcome(job.name, result.value, result.refused)


def _made(job: Job, digest: str) -> dict[str, Any]:
    """In the process of a job: make the piece's document, and keep it."""
    key, content = digest.split(":")
    # read back, so that a piece is the same from the cache and from here
    with refusing(PieceError, Path(job.name), "mesh"):
        document = json.loads(json.dumps(make(job, content)))
    # a read-only home costs the time again, nothing else
    with contextlib.suppress(PieceError):
        store.write(_cached(key), document)
    return document

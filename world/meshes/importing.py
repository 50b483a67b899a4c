"""Import of many meshes, each in its own process with bounded time and memory, with a cache."""

import contextlib
import hashlib
import itertools
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from world import bounded, surroundings
from world.errors import PieceError
from world.furniture.piece import Piece
from world.meshes import notes, source, store, sweethome
from world.meshes.build import ImportOptions, build
from world.meshes.classes import CLASSES, category_of_names
from world.meshes.notes import Note
from world.placeholders import read_bounded
from world.refusals import refusing

CPU_S = 120
"""Greatest processor time of one piece, s."""
WALL_S = 600
"""Greatest wall-clock time of one piece, s."""
MEMORY_BYTES = 8 * 1024**3
"""Greatest address space of one piece."""
ADVICE = "repair or decimate the mesh"
MAKER = 7
"""Version of the build; a new one invalidates cached pieces."""


@dataclass(frozen=True)
class Job:
    """One mesh to import."""

    name: str
    file_name: str
    options: ImportOptions
    path: Path | None = None
    """File of the mesh; None where `entry` has it."""
    entry: sweethome.Entry | None = None
    refused: str = ""
    """Reason why it cannot be imported; empty without one."""


@dataclass(frozen=True)
class Outcome:
    """Result of an import."""

    name: str
    document: dict[str, Any] | None
    """Content of the piece file; None where refused."""
    refused: str
    """Reason of the refusal; empty without one."""
    cached: bool = False

    def piece(self) -> Piece | None:
        """The piece, if there is one."""
        return None if self.document is None else store.piece_of(self.document, self.name)


def cache_folder() -> Path | None:
    """The folder of cached pieces; None for a user without a home."""
    folder = surroundings.cache_folder()
    return None if folder is None else folder / "objects"


def jobs(paths: Sequence[Path], options: ImportOptions) -> list[Job]:
    """The jobs of files, folders and libraries. Raises PieceError for a path without meshes."""
    found: list[Job] = []
    for path in paths:
        if path.is_dir():
            files = sorted(p for p in path.rglob("*") if p.suffix.lower() in _READ)
            if not files:
                raise PieceError(f"{path}: no meshes; choose files of {', '.join(_READ)}")
            for file in files:
                found += _of_file(file, options, notes.of_file(file))
        elif path.exists():
            found += _of_file(path, options, notes.of_file(path))
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
    """Outcomes of the jobs, in their order; `done` is called with each as it ends.

    Raises PieceError where `stopped` returns true before all are done.
    """
    outcomes: dict[int, Outcome] = {}
    waiting: list[tuple[int, Job, str]] = []
    for index, job in enumerate(work):
        ready, digest = _cached_outcome(job)
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
    """The document of a job's piece. Raises InhabitError where it is refused."""
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
    named = folder if folder in CLASSES else category_of_names(path.stem)
    licence = note.licence or options.licence
    credit = options.credit or note.credit
    own = replace(options, named=named, licence=licence, credit=credit)
    return [Job(_tidy(path.stem), path.name, own, path)]


def _of_library(path: Path, options: ImportOptions) -> list[Job]:
    """The jobs of a library's furniture; other objects (a lamp, a door) are left out."""
    found = []
    for entry in sweethome.entries(path):
        named = category_of_names(entry.title) or category_of_names(entry.name)
        if options.category is None and named is None:
            continue
        licence = entry.licence or options.licence
        own = replace(
            options,
            frame=entry.frame,
            named=named,
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
    """The jobs with unique names: repeated ones get the first number that no job has."""
    own, taken = {job.name for job in found}, set[str]()
    result = []
    for job in found:
        names = itertools.chain([job.name], (f"{job.name}-{n}" for n in itertools.count(2)))
        name = next(n for n in names if n not in taken and (n == job.name or n not in own))
        taken.add(name)
        result.append(replace(job, name=name))
    return result


def replaced(work: Sequence[Job], folder: Path) -> list[Path]:
    """The files in a folder that pieces of the jobs would replace, although they are not pieces of
    the same meshes."""
    found = []
    for job in work:
        file = folder / f"{job.name}{store.SUFFIX}"
        if job.refused or not file.exists():
            continue
        with contextlib.suppress(PieceError, OSError, KeyError, TypeError):
            if (
                store.read_document(file)["source"]["sha256"]
                == hashlib.sha256(_content(job)).hexdigest()
            ):
                continue
        found.append(file)
    return found


def _content(job: Job) -> bytes:
    """What a job's mesh is made from. Raises OSError."""
    if job.entry is not None:
        return job.entry.content + repr(job.entry.rotation).encode()
    return b"" if job.path is None else read_bounded(job.path, source.MAX_BYTES)


def _cached_outcome(job: Job) -> tuple[Outcome | None, str]:
    """The outcome where it is refused or cached, else None with the digests of the inputs."""
    if job.refused:
        return Outcome(job.name, None, job.refused), ""
    try:
        digest = hashlib.sha256(_content(job))
    except OSError as error:
        return Outcome(job.name, None, f"cannot read {job.path}: {error.strerror}"), ""
    content = digest.hexdigest()
    digest.update(json.dumps([MAKER, job.name, asdict(job.options)], default=str).encode())
    folder, key = cache_folder(), digest.hexdigest()
    with contextlib.suppress(PieceError):
        if folder is not None:
            kept = store.read_document(folder / f"{key}.json")
            store.piece_of(kept, job.name)
            return Outcome(job.name, kept, "", cached=True), ""
    return None, f"{key}:{content}"


def _processes(
    waiting: list[tuple[int, Job, str]], workers: int, stopped: Callable[[], bool]
) -> Iterator[tuple[int, Outcome]]:
    """Outcomes of the jobs as they end, each made in its own process."""
    bounds = bounded.Bounds(CPU_S, WALL_S, MEMORY_BYTES)
    # the folder is named here: the server that forks the processes keeps its first environment
    kept = cache_folder()
    tasks = [bounded.Task(_shown(job), (job, digest, kept), bounds) for _, job, digest in waiting]
    libraries = ("trimesh", "vhacdx", "scipy.spatial")
    for position, result in bounded.run(tasks, _made, workers, ADVICE, libraries, stopped):
        index, job, _ = waiting[position]
        yield index, Outcome(job.name, result.value, result.refused)


def _made(job: Job, digest: str, kept: Path | None) -> dict[str, Any]:
    """In the process of a job: make the piece's document, and cache it in the folder
    `kept` if there is one."""
    key, content = digest.split(":")
    # a JSON round trip, so that new and cached pieces are the same
    with refusing(PieceError, Path(_shown(job)), "mesh"):
        try:
            document = json.loads(json.dumps(make(job, content)))
        except PieceError as error:
            # the file as the user named it, instead of the piece
            raise PieceError(str(error).removeprefix(f"{job.name}: ")) from error
    # with a read-only home pieces are made again each time
    with contextlib.suppress(PieceError):
        if kept is not None:
            store.write(kept / f"{key}.json", document)
    return document


def _shown(job: Job) -> str:
    """The name of a job in messages: its file, or its entry of a library."""
    return job.name if job.entry is not None else job.file_name

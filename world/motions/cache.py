"""Disk cache of clips: the package's own take seconds to make.

The key is the digest of the code that makes them, so that a change of it makes them again.
"""

import contextlib
import hashlib
from collections.abc import Callable, Sequence
from importlib import resources
from pathlib import Path

import numpy as np

from world.errors import ClipError
from world.motions import clip_file, npz
from world.motions.clip import Clip, validate
from world.refusals import refusing
from world.surroundings import cache_folder


def code_digest(package: str) -> str:
    """A digest of a package's Python files."""
    digest = hashlib.sha256()
    for file in sorted(resources.files(package).iterdir(), key=lambda f: f.name):
        if file.name.endswith(".py"):
            digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


def cached(key: str, make: Callable[[], Sequence[Clip]]) -> tuple[Clip, ...]:
    """The clips under `key`; they are made where the cache is missing or damaged."""
    folder = cache_folder()
    if folder is None:
        return tuple(make())
    path = folder / f"clips-{key}.npz"
    try:
        return read(path)
    except ClipError:
        clips = tuple(make())
    # with a read-only home they are made again each time
    with contextlib.suppress(OSError):
        write(path, clips)
    return clips


def write(path: Path, clips: Sequence[Clip]) -> None:
    """Write all clips to one file, atomically."""
    content = {"count": np.array(len(clips))}
    for index, clip in enumerate(clips):
        content |= {f"{index}/{key}": value for key, value in clip_file.arrays(clip).items()}
    clip_file.write_arrays(path, content)


def read(path: Path) -> tuple[Clip, ...]:
    """Read what `write` wrote. Raises ClipError where the file is missing or damaged."""
    with refusing(ClipError, path, "cache of clips"):
        return _read(path)


def _read(path: Path) -> tuple[Clip, ...]:
    with npz.opened(path) as file:
        every: dict[int, dict[str, np.ndarray]] = {i: {} for i in range(_count(file))}
        for name in file:
            index, _, key = name.partition("/")
            if key:
                every[int(index)][key] = file[name]
    return tuple(validate(clip_file.clip_of(content, str(path))) for content in every.values())


def _count(file: npz.Arrays) -> int:
    count = int(file["count"])
    if not 0 < count <= len(file):
        raise ClipError(f"{count} clips in {len(file)} arrays")
    return count

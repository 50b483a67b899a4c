"""Clips from files and folders, or the package's own where none are given."""

from collections.abc import Sequence
from functools import cache, lru_cache
from pathlib import Path

from world.errors import ClipError
from world.motions import cache as disk
from world.motions.augment import at_speed
from world.motions.clip import Clip
from world.motions.clip_file import SUFFIX, is_smpl, read
from world.motions.library import MotionLibrary
from world.motions.uses.seat import SEAT
from world.motions.uses.use import ClipUse
from world.surroundings import expanded


def find(paths: Sequence[str]) -> list[Path]:
    """The clip files of files and folders, sorted; a folder's SMPL parameters are none. Raises
    ClipError for a path without any."""
    found: list[Path] = []
    for text in paths:
        path = expanded(Path(text))
        if path.is_dir():
            here = [p for p in _files(path) if not is_smpl(p)]
        elif path.is_file():
            here = [path]
        else:
            raise ClipError(f"{path}: no such file or folder of clips")
        if not here:
            raise ClipError(
                f"{path}: no clips found, they end in {SUFFIX}"
                " ('inhabit motions import' makes clips of others)"
            )
        found += here
    return found


def note_others(paths: Sequence[str]) -> str:
    """A line on the files in folders that end like clips and are none; empty without any."""
    folders = [expanded(Path(text)) for text in paths]
    names = [p.name for folder in folders if folder.is_dir() for p in _files(folder) if is_smpl(p)]
    if not names:
        return ""
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return f"left out, SMPL parameters and not clips: {', '.join(names[:3])}{more}"


def _files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.suffix.lower() == SUFFIX)


def own_clips() -> list[Clip]:
    """The package's own motions: synthetic, licence-free, cached on disk."""
    return list(_synthetic())


@cache
def _synthetic() -> tuple[Clip, ...]:
    from world.motions.synthetic.library import generate

    return disk.cached(disk.code_digest("world.motions.synthetic"), generate)


def clips(paths: Sequence[str] = (), use: ClipUse = SEAT) -> list[Clip]:
    """Clips prepared for a use: those of `paths`, or the package's own."""
    if not paths:
        return [clip for clip in own_clips() if use.accepts(clip)]
    return [part for path in find(paths) for part in use.prepare(read(path))]


def library(
    paths: Sequence[str] = (),
    mirror: bool = True,
    use: ClipUse = SEAT,
    playback_speeds: Sequence[float] = (),
) -> MotionLibrary:
    """The motion library of `paths`, or of the package's own clips, for a use.

    Each clip is added at each playback speed, and with `mirror` the mirror images of all.
    """
    own_speed = clips(paths, use)
    every = [
        *own_speed,
        *(at_speed(clip, speed) for speed in playback_speeds for clip in own_speed),
    ]
    return MotionLibrary(every, mirror, use)


@lru_cache(maxsize=2)
def cached_library(
    paths: tuple[str, ...], mirror: bool, use: ClipUse, playback_speeds: tuple[float, ...]
) -> MotionLibrary:
    """`library`, read once per process."""
    return library(paths, mirror, use, playback_speeds)

"""Clips from files and folders, or the package's own where none are named."""

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

from world import tasks
from world.errors import ClipError
from world.motions import cache as disk
from world.motions import samp
from world.motions.augment import paced
from world.motions.clip import Clip, validate
from world.motions.fit import ground
from world.motions.library import MotionLibrary, prepare
from world.refusals import refusing

#: Readers by file suffix. A new format is a file and a line here.
READERS: dict[str, Callable[[Path], Clip]] = {samp.SUFFIX: samp.read}


def find(paths: Sequence[str]) -> list[Path]:
    """The clip files among files and folders, sorted; ClipError names a path without any."""
    found: list[Path] = []
    for text in paths:
        path = Path(text).expanduser()
        if path.is_dir():
            here = sorted(p for p in path.rglob("*") if p.suffix.lower() in READERS)
        elif path.is_file():
            here = [path]
        else:
            raise ClipError(f"{path}: no such file or folder of clips")
        if not here:
            raise ClipError(
                f"{path}: no clips found; formats: {', '.join(sorted(READERS))}"
                " ('inhabit motions import' makes clips of others)"
            )
        found += here
    return found


def read(path: Path) -> Clip:
    """One raw clip, checked; ClipError if no reader knows it or it does not fit the character."""
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise ClipError(
            f"{path}: unknown clip format '{path.suffix}'; formats: {', '.join(sorted(READERS))}"
            " ('inhabit motions import' makes clips of others)"
        )
    with refusing(ClipError, path, "clip"):
        return validate(reader(path))


def own_clips() -> list[Clip]:
    """The package's own motions, made by code, licence-free; made once on a machine."""
    return list(_synthetic())


@cache
def _synthetic() -> tuple[Clip, ...]:
    from world.motions.synthetic.library import generate

    return disk.cached(disk.code_digest("world.motions.synthetic"), generate)


def clips(paths: Sequence[str] = (), task: str = "sit") -> list[Clip]:
    """Clips ready to train a task: those of `paths`, or the package's own."""
    if not paths:
        return [clip for clip in own_clips() if ground.serves(clip, task)]
    return [part for path in find(paths) for part in prepare(read(path), task)]


def library(
    paths: Sequence[str] = (),
    mirror: bool = True,
    task: str = "sit",
    paces: Sequence[float] = (),
) -> MotionLibrary:
    """The motion library of `paths`, or of the package's own clips, for a task.

    Each clip comes again as many times as fast as `paces` say, and with `mirror` all of them
    reflected.
    """
    own_pace = clips(paths, task)
    every = [*own_pace, *(paced(clip, pace) for pace in paces for clip in own_pace)]
    return MotionLibrary(every, mirror, tasks.make(task).affordance)

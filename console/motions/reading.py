"""Clips that the commands of `motions` read: those of paths, or the package's own."""

from console.terminal import doing, note, progress
from world.motions import load
from world.motions.clip import Clip
from world.motions.fit.objects import with_any


def clips(paths: tuple[str, ...]) -> tuple[Clip, ...]:
    """Return the clips of paths, or the package's own, with their objects."""
    if not paths:
        with doing("making the package's own clips"):
            return tuple(load.own_clips())
    files, found = load.find(paths), list[Clip]()
    note(load.note_others(paths))
    with progress("files", len(files), "reading clips") as update:
        for done, file in enumerate(files, 1):
            found += with_any(load.read(file))
            update(done)
    return tuple(found)

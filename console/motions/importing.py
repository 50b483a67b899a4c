"""`inhabit motions import`: motions of any known format as clips of the character."""

import sys
import time
from collections import Counter
from pathlib import Path

from console.commands import MotionsImport
from console.motions import child, measures
from world.errors import ClipError, ConfigError
from world.motions import clip_file
from world.motions.clip import Clip
from world.motions.formats import landmarks, registry
from world.motions.formats.landmarks import Map
from world.motions.retarget.convert import retargeted
from world.refusals import refusing


def import_command(command: MotionsImport) -> int:
    """Write a clip for each motion; 1 if a file was refused, which leaves nothing of it."""
    if not command.paths:
        raise ConfigError("motions import: name the files or folders to import")
    paths = registry.find(list(command.paths), command.format)
    given = landmarks.read_map(command.map) if command.map else Map()
    names = distinct(paths)
    there = [n for n in names if (command.out / f"{n}.npz").exists()]
    if there and not command.replace:
        raise ClipError(
            f"{command.out}: already holds {there[0]}.npz"
            + (f" and {len(there) - 1} more" if len(there) > 1 else "")
            + "; --replace writes over them"
        )
    started, written, seconds = time.monotonic(), 0, 0.0
    refused = 0
    tasks = [
        child.task(path, (path, name, command.format, given, command.out / f"{name}.npz"))
        for path, name in zip(paths, names, strict=True)
    ]
    for result in child.in_order(tasks, _written):
        if result.refused:
            refused += 1
            print(f"inhabit: {result.refused}", file=sys.stderr, flush=True)
            continue
        written, seconds = written + 1, seconds + result.value["seconds"]
        print(result.value["line"], flush=True)
    took = time.monotonic() - started
    print(
        f"{written} clips, {seconds:.0f} s of motion in {took:.0f} s: {command.out}"
        + (f"; {refused} refused" if refused else "")
    )
    return 1 if refused else 0


def _written(
    path: Path, name: str, form: str | None, given: Map, out: Path
) -> dict[str, str | float]:
    """In the process of a file: write its clip."""
    with refusing(ClipError, path, "motion"):
        clip = imported(path, name, form, given)
        said = line(clip)
    clip_file.write(out, clip)
    return {"line": said, "seconds": clip.seconds}


def imported(path: Path, name: str, form: str | None = None, given: Map | None = None) -> Clip:
    """The clip of a file of any format, under a name."""
    from dataclasses import replace

    return replace(retargeted(registry.read(path, form), given), name=name)


def line(clip: Clip) -> str:
    """What there is to say of an imported clip, in a line."""
    report = measures.examine(clip)
    breaks = ", ".join(f"{t:.2f} s" for t in report.discontinuities)
    return (
        f"{clip.name}: {clip.seconds:.1f} s, hands and feet {100 * report.key_body_error_m:.1f} cm"
        f" off, {report.verdict}" + (f", breaks at {breaks}" if breaks else "")
    )


def distinct(paths: list[Path]) -> list[str]:
    """A name for each file: its own, with its folder's in front where two are called the same, and
    its suffix behind where they lie in one folder."""
    names = [path.stem for path in paths]
    for longer in (
        lambda path: f"{path.resolve().parent.name}_{path.stem}",
        lambda path: f"{path.resolve().parent.name}_{path.stem}_{path.suffix[1:]}",
    ):
        counts = Counter(names)
        names = [
            name if counts[name] == 1 else longer(path)
            for path, name in zip(paths, names, strict=True)
        ]
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise ClipError(f"two motions are called {twice[0]}; import their folders one by one")
    return names

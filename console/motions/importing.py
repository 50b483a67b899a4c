"""`inhabit motions import`: motions of any known format as clips of the character."""

import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from console.commands import MotionsCheck, MotionsImport
from console.motions import child, measures
from console.terminal import counted
from world.errors import ClipError, ConfigError
from world.motions import clip_file
from world.motions.clip import Clip
from world.motions.formats import landmarks, registry
from world.motions.formats.landmarks import Map
from world.motions.formats.recording import Recording
from world.motions.retarget.convert import retargeted
from world.refusals import refusing


def import_command(command: MotionsImport) -> int:
    """Write a clip for each motion; return 1 if any is refused, of which nothing is written."""
    paths = registry.find(list(command.paths), command.format)
    given = stated(command)
    names = distinct(paths)
    there = [n for n in names if (command.out / f"{n}.npz").exists()]
    if there and not command.replace:
        raise ConfigError(
            f"--out {command.out}: already holds {there[0]}.npz"
            + (f" and {len(there) - 1} more" if len(there) > 1 else "")
            + "; --replace overwrites them"
        )
    started, written, seconds = time.monotonic(), 0, 0.0
    refused = implausible = 0
    named = {path.expanduser() for path in command.paths}
    tasks = [
        child.task(
            path,
            (
                ClipSource(path, name, command.format, given, path in named),
                command.out / f"{name}.npz",
            ),
        )
        for path, name in zip(paths, names, strict=True)
    ]
    remarks: Counter[str] = Counter()
    left_out: list[str] = []
    for path, result in zip(paths, child.in_order(tasks, _written, "importing"), strict=True):
        if result.refused:
            refused += 1
            print(f"inhabit: {result.refused}", file=sys.stderr, flush=True)
            continue
        if result.value is None:
            left_out.append(path.name)
            continue
        remarks.update(result.value["remarks"])
        implausible += result.value["implausible"]
        written, seconds = written + 1, seconds + result.value["seconds"]
        print(result.value["line"], flush=True)
    for remark, count in remarks.items():
        print(f"note: {remark}" + (f" ({count} clips)" if count > 1 else ""))
    if left_out:
        more = f" and {len(left_out) - 3} more" if len(left_out) > 3 else ""
        print(f"note: left out, since they hold no motion: {', '.join(left_out[:3])}{more}")
    if not written and not refused:
        raise ClipError(f"{', '.join(map(str, command.paths))}: holds no motion to import")
    took = time.monotonic() - started
    print(
        f"{counted(written, 'clip')}, {seconds:.0f} s of motion in {took:.0f} s: {command.out}"
        + (f"; {implausible} implausible" if implausible else "")
        + (f"; {refused} refused" if refused else "")
    )
    return 1 if refused else 0


@dataclass(frozen=True)
class ClipSource:
    """A file to import, and what the user states about it."""

    path: Path
    name: str
    form: str | None
    given: Map
    named: bool
    """Whether the user named the file itself, rather than its folder."""

    def holds_none(self) -> bool:
        """Whether it is a file of a folder that belongs to motions and holds none."""
        return not self.named and registry.is_companion(self.path)

    def recording(self) -> Recording:
        """The motion in the file, at the stated rate if any."""
        return registry.read(self.path, self.form, self.given.fps)

    def rate_stated(self, recording: Recording) -> bool:
        """Whether the rate of the file's motion is what the file itself states."""
        return self.given.fps is None and not recording.fps_assumed

    def clip(self, recording: Recording) -> Clip:
        """The clip of the file's motion."""
        return replace(retargeted(recording, self.given), name=self.name)


@contextmanager
def refusing_whole(path: Path) -> Iterator[None]:
    """Context in which every refusal of a motion begins with the path that the user gave."""
    try:
        with refusing(ClipError, path, "motion"):
            yield
    except ClipError as error:
        text = str(error)
        for own in (str(path), path.name, path.stem):
            text = text.removeprefix(f"{own}: ")
        raise ClipError(f"{path}: {text}") from error


def stated(command: MotionsImport | MotionsCheck) -> Map:
    """Return what map file and flags state; a flag overrides the file."""
    try:
        given = landmarks.read_map(command.map) if command.map else Map()
    except ClipError as error:
        raise ConfigError(f"--map {error}") from error
    return replace(
        given,
        fps=command.fps or given.fps,
        unit_m=landmarks.UNITS_M[command.unit] if command.unit else given.unit_m,
        up=command.up or given.up,
    )


def _written(source: ClipSource, out: Path) -> dict[str, Any] | None:
    """Write the clip of a file; None for a file without motion. Runs in a child process."""
    with refusing_whole(source.path):
        if source.holds_none():
            return None
        recording = source.recording()
        clip = source.clip(recording)
        report = measures.examine(clip, recording.fps, source.rate_stated(recording))
    clip_file.write(out, clip)
    return {
        "line": line(clip, report),
        "seconds": clip.seconds,
        "remarks": recording.remarks,
        "implausible": bool(report.implausible),
    }


def line(clip: Clip, report: measures.ClipReport) -> str:
    """Return one line on an imported clip."""
    breaks = ", ".join(f"{t:.2f} s" for t in report.discontinuities)
    return (
        f"{clip.name}: {clip.seconds:.1f} s, hands and feet {100 * report.key_body_error_m:.1f} cm"
        f" off, {report.verdict}"
        + (f": {report.implausible}" if report.implausible else "")
        + (f", breaks at {breaks}" if breaks else "")
    )


def distinct(paths: list[Path]) -> list[str]:
    """Return distinct names of files: the file's own, preceded by the folder's for equal names, and
    followed by the suffix for equal names in one folder."""
    names = [path.stem.removesuffix(".smpl") for path in paths]
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
        raise ClipError(f"two motions have the name {twice[0]}: import their folders one by one")
    return names

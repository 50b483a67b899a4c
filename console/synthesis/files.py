"""The files that a motion can be written to, by suffix: clip, BVH, 3-D page, film, recording."""

import os
from collections.abc import Callable, Sequence
from pathlib import Path

from console.recording import format as recording
from console.recording.format import Recording
from console.run.directory import write_text
from console.synthesis import replay
from console.synthesis.motion import Motion
from console.video import rendering
from world.character import model as character
from world.errors import ConfigError, InhabitError
from world.motions import bvh_file, clip_file

Writer = Callable[[Path, Motion], None]


class MotionFileError(InhabitError):
    """A file of a motion that cannot be written."""


def _clip(path: Path, motion: Motion) -> None:
    clip_file.write(path, motion.clip())
    path.chmod(0o644)  # written for its owner alone, meant for everybody


def _bvh(path: Path, motion: Motion) -> None:
    write_text(path, bvh_file.text(motion.clip()))


def _page(path: Path, motion: Motion) -> None:
    write_text(path, replay.page(motion))


def _film(path: Path, motion: Motion) -> None:
    rendering.write_video(recorded(motion), path, model=motion.track.model)


def _states(path: Path, motion: Motion) -> None:
    recording.write(path, recorded(motion))


#: Writers by suffix. A new format is a function and a line here.
WRITERS: dict[str, Writer] = {
    ".npz": _clip,
    ".bvh": _bvh,
    ".html": _page,
    ".mp4": _film,
    ".msgpack": _states,
}


def recorded(motion: Motion) -> Recording:
    """The motion as a recording of one take."""
    served = motion.served
    meta = {
        "task": served.task.name,
        "checkpoint": served.version,
        "control_hz": character.CONTROL_HZ,
    }
    return Recording([motion.track.take], meta)


def check(paths: Sequence[Path], overwrite: bool) -> None:
    """ConfigError where a file's kind is unknown, it is named twice, or it is there already."""
    if not paths:
        raise ConfigError(f"nothing to write: give --out FILE, one of {', '.join(WRITERS)}")
    if len({path.resolve() for path in paths}) < len(paths):
        raise ConfigError("--out names one file twice")
    for path in paths:
        if path.suffix.lower() not in WRITERS:
            raise ConfigError(
                f"--out {path}: unknown kind of file '{path.suffix}'; choose {', '.join(WRITERS)}"
            )
        if path.is_dir() or (path.exists() and not overwrite):
            raise ConfigError(f"--out {path} exists: name another file, or add --overwrite")
        folder = next(folder for folder in path.absolute().parents if folder.exists())
        if not (folder.is_dir() and os.access(folder, os.W_OK)):
            raise ConfigError(f"--out {path}: {folder} is no folder that can be written to")
    if any(path.suffix.lower() == ".mp4" for path in paths):
        rendering.require_gl()


def write(path: Path, motion: Motion) -> None:
    """Write a motion to a file, whole or not at all; MotionFileError where that fails."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        WRITERS[path.suffix.lower()](path, motion)
    except OSError as error:
        raise MotionFileError(f"cannot write {path}: {error.strerror or error}") from error

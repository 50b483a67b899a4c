"""Files of a motion by suffix: clip, BVH, 3-D page, video, recording."""

import os
from collections.abc import Callable, Sequence
from pathlib import Path

from console.recording import format as recording
from console.recording.format import Recording
from console.run.directory import write_text
from console.synthesis import replay
from console.synthesis.motion import Motion
from console.video import rendering
from policy.checkpoints import lineage
from world.character import model as character
from world.errors import ConfigError, InhabitError
from world.motions import bvh_file, clip_file

Writer = Callable[[Path, Motion], None]


class MotionFileError(InhabitError):
    """A file of a motion that cannot be written."""


def _clip(path: Path, motion: Motion) -> None:
    clip_file.write(path, motion.clip())
    path.chmod(0o644)  # the clip is written readable for its owner alone


def _bvh(path: Path, motion: Motion) -> None:
    clip = motion.clip()
    write_text(path, bvh_file.text(clip))
    # BVH has no place for terms: they are beside it, as the REUSE specification names such a file
    write_text(path.with_name(f"{path.name}.license"), f"{clip.licence}\n{clip.source}\n")


def _page(path: Path, motion: Motion) -> None:
    write_text(path, replay.page(motion))


def _video(path: Path, motion: Motion) -> None:
    rendering.write_video(recorded(motion), path, model=motion.track.model)


def _states(path: Path, motion: Motion) -> None:
    recording.write(path, recorded(motion))


#: Writers by suffix. A new format is one function and one line here.
WRITERS: dict[str, Writer] = {
    ".npz": _clip,
    ".bvh": _bvh,
    ".html": _page,
    ".mp4": _video,
    ".msgpack": _states,
}


def recorded(motion: Motion) -> Recording:
    """Return the motion as a recording of one take."""
    served = motion.served
    meta = {
        "task": served.task.name,
        "checkpoint": served.version,
        "control_hz": character.CONTROL_HZ,
        "trained_on": lineage.data(served.manifest.notes),
        "licence": lineage.licence(served.manifest.notes),
    }
    return Recording([motion.track.take], meta)


def check(paths: Sequence[Path], overwrite: bool) -> None:
    """Raise ConfigError for a file of an unknown suffix, named twice, or existing."""
    if not paths:
        raise ConfigError(f"nothing to write: give --out FILE, one of {', '.join(WRITERS)}")
    if len({path.resolve() for path in paths}) < len(paths):
        raise ConfigError("--out names one file twice")
    for path in paths:
        if path.suffix.lower() not in WRITERS:
            raise ConfigError(
                f"--out {path}: unknown suffix '{path.suffix}'; choose {', '.join(WRITERS)}"
            )
        if path.is_dir() or (path.exists() and not overwrite):
            raise ConfigError(f"--out {path} exists: name another file, or add --overwrite")
        folder = next(folder for folder in path.absolute().parents if folder.exists())
        if not (folder.is_dir() and os.access(folder, os.W_OK)):
            raise ConfigError(f"--out {path}: {folder} is not a writable folder")
    if any(path.suffix.lower() == ".mp4" for path in paths):
        rendering.require_gl()


def write(path: Path, motion: Motion) -> None:
    """Write a motion to a file, whole or not at all; MotionFileError for a failed write."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        WRITERS[path.suffix.lower()](path, motion)
    except OSError as error:
        raise MotionFileError(f"cannot write {path}: {error.strerror or error}") from error

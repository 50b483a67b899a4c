"""Files of a motion by suffix: clip, glTF, BVH, SMPL, 3-D page, video, recording."""

import os
from collections.abc import Callable, Sequence
from pathlib import Path

from console.animation import files as animation
from console.animation.files import Animation, suffix_of
from console.animation.objects import Shape
from console.commands.animation import AnimationFlags
from console.recording import format as recording
from console.recording.format import Recording
from console.run import machine
from console.run.directory import write_text
from console.synthesis import replay
from console.synthesis.motion import Motion
from console.terminal import progress
from console.video import rendering
from policy.checkpoints import lineage
from world.character import model as character
from world.errors import ConfigError, InhabitError
from world.motions import clip_file
from world.refusals import unknown_suffix

Writer = Callable[[Path, Motion], None]
DEFAULT = AnimationFlags()


class MotionFileError(InhabitError):
    """A file of a motion that cannot be written."""


def _clip(path: Path, motion: Motion) -> None:
    clip_file.write(path, motion.clip())
    path.chmod(0o644)  # the clip is written readable for its owner alone


def _page(path: Path, motion: Motion) -> None:
    write_text(path, replay.page(motion))


def _video(path: Path, motion: Motion) -> None:
    film = recorded(motion)
    with progress("images", rendering.image_count(film), f"drawing {path.name}") as update:
        rendering.write_video(
            film, path, model=motion.track.model, progress=update, threads=machine.cores()
        )


def _states(path: Path, motion: Motion) -> None:
    recording.write(path, recorded(motion))


#: Writers by suffix, besides those for animation programs. A new format is one function and one
#: line here.
WRITERS: dict[str, Writer] = {
    ".npz": _clip,
    ".html": _page,
    ".mp4": _video,
    ".msgpack": _states,
}
SUFFIXES = (".npz", *animation.WRITERS, *(suffix for suffix in WRITERS if suffix != ".npz"))


def recorded(motion: Motion) -> Recording:
    """Return the motion as a recording of one take."""
    served = motion.served
    meta = {
        "task": served.task.name,
        "checkpoint": served.version,
        "control_hz": character.CONTROL_HZ,
        "trained_on": lineage.data(served.manifest.notes),
        "licence": motion.licence(),
    }
    return Recording([motion.track.take], meta)


def check(paths: Sequence[Path], overwrite: bool, flags: AnimationFlags = DEFAULT) -> None:
    """Raise ConfigError for a file of an unknown suffix, named twice, or existing, and for flags of
    the files that cannot be met."""
    if not paths:
        raise ConfigError(f"nothing to write: give --out FILE, one of {', '.join(SUFFIXES)}")
    animation.refuse_fbx(paths, "--out")
    if len({path.resolve() for path in paths}) < len(paths):
        raise ConfigError("--out names one file twice")
    for path in paths:
        if not suffix_of(path, SUFFIXES):
            raise ConfigError(f"--out {path}: {unknown_suffix(path)}; choose {', '.join(SUFFIXES)}")
        if path.is_dir() or (path.exists() and not overwrite):
            raise ConfigError(f"--out {path} exists: name another file, or add --overwrite")
        folder = next(folder for folder in path.absolute().parents if folder.exists())
        if not (folder.is_dir() and os.access(folder, os.W_OK)):
            raise ConfigError(f"--out {path}: {folder} is not a writable folder")
    animation.check(flags, paths)
    if any(path.suffix.lower() == ".mp4" for path in paths):
        rendering.require_gl()


def write(
    path: Path,
    motion: Motion,
    flags: AnimationFlags = DEFAULT,
    mesh: Shape | None = None,
) -> None:
    """Write a motion to a file, whole or not at all; MotionFileError for a failed write.

    mesh: the furniture's own surface, for formats of animation programs.
    """
    try:
        if suffix_of(path, tuple(animation.WRITERS)):
            track = motion.track
            scene = Animation(motion.clip(), track.take, track.model, mesh)
            animation.write(path, scene, flags)
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        WRITERS[path.suffix.lower()](path, motion)
    except OSError as error:
        raise MotionFileError(f"cannot write {path}: {error.strerror or error}") from error

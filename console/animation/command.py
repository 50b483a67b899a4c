"""`inhabit export`: a policy as ONNX, or a motion for animation programs and engines."""

import os
from pathlib import Path

import numpy as np

from console.animation import files
from console.animation.files import Animation
from console.commands import Export
from console.recording import format as recording
from console.recording.clip import clip_of
from console.recording.format import Recording
from console.terminal import counted
from world.character.model import CONTROL_HZ
from world.errors import ConfigError, InhabitError
from world.motions import clip_file
from world.refusals import unknown_suffix

RECORDING, CLIP, POLICY = ".msgpack", clip_file.SUFFIX, ".onnx"


class ExportFileError(InhabitError):
    """A file of a motion that cannot be written."""


def export_command(command: Export) -> int:
    """Write the file; return the exit code."""
    files.refuse_fbx([command.out], "FILE")
    suffix = files.suffix_of(command.out, (POLICY, *files.WRITERS))
    if not suffix:
        raise ConfigError(
            f"FILE {command.out}: {unknown_suffix(command.out)}; choose {POLICY} for a"
            f" policy, {', '.join(files.WRITERS)} for a motion"
        )
    _writable(command.out)
    of_policy = not command.source.is_file()
    if suffix == POLICY:
        if not of_policy:
            of_motion = command.source.suffix.lower() in (RECORDING, CLIP)
            raise ConfigError(
                f"{command.source} is a motion: it is exported as {', '.join(files.WRITERS)}"
                if of_motion
                else f"{command.source} is a file, and no policy: give a run or a checkpoint folder"
            )
        if command.take is not None:
            raise ConfigError(f"--take {command.take}: for a recording, and a policy is exported")
        files.check(command.files, [command.out])
        return _policy(command)
    if of_policy:
        raise ConfigError(
            f"{command.source}: no recording ({RECORDING}) or motion clip ({CLIP}); a policy is"
            f" exported as {POLICY}, and its motion is written by inhabit synthesize"
        )
    if command.checkpoint != "best":
        raise ConfigError(
            f"--checkpoint {command.checkpoint}: for a policy, and a motion is exported"
        )
    files.check(command.files, [command.out])
    motion = of_file(command.source, command.take)
    try:
        files.write(command.out, motion, command.files)
    except OSError as error:
        raise ExportFileError(f"cannot write {command.out}: {error.strerror or error}") from error
    clip = motion.clip
    print(f"{command.out}: {clip.frames} frames, {(clip.frames - 1) / clip.fps:.1f} s")
    return 0


def of_file(path: Path, take: int | None = None) -> Animation:
    """Return the motion of a recording's take, or of a clip. Raises InhabitError in one line."""
    suffix = path.suffix.lower()
    if suffix not in (RECORDING, CLIP):
        raise ConfigError(
            f"{path}: {unknown_suffix(path)}; choose a recording ({RECORDING}) or a motion"
            f" clip ({CLIP}); inhabit motions import makes clips of other motions"
        )
    if suffix == RECORDING:
        return of_recording(recording.read(path), path, take)
    if take is not None:
        raise ConfigError(f"--take {take}: {path} is a clip, not a recording: leave it out")
    return Animation(clip_file.read(path))


def of_recording(found: Recording, path: Path, number: int | None) -> Animation:
    """Return a take of a recording: the one of the number, or the only one."""
    count = len(found.takes)
    if number is None and count == 1:
        number = 0
    if number is None or not 0 <= number < count:
        given = f"--take {number}: " if number is not None else ""
        choice = (
            "choose --take 0, the only one" if count == 1 else f"choose --take 0 to {count - 1}"
        )
        raise ConfigError(
            f"{given}{path} has {counted(count, 'take')}; {choice}"
            if count
            else f"{path} has no takes"
        )
    take = found.takes[number]
    if len(take) < 2 or not np.isfinite(take.qpos).all():
        what = "non-finite states" if len(take) >= 2 else f"{len(take)} frame(s)"
        raise InhabitError(f"{path}: take {number} has {what}: it is no motion to export")
    task = str(found.meta.get("task", "motion"))
    clip = clip_of(
        take,
        f"{task}-{take.piece}" if take.piece else task,
        f"recording {path.name}, checkpoint {found.meta.get('checkpoint', 'unknown')}",
        str(found.meta.get("licence", "unknown")),
        round(float(found.meta.get("control_hz", CONTROL_HZ))),
    )
    return Animation(clip, take, recording.model_of(take))


def _policy(command: Export) -> int:
    """Export a policy; flags of motions are refused."""
    from console.serving.export import export_policy

    if command.take is not None:
        raise ConfigError(f"--take {command.take}: it is for recordings; leave it out")
    files.check(command.files, [command.out])
    return export_policy(command)


def _writable(path: Path) -> None:
    if path.is_dir():
        raise ConfigError(f"FILE {path}: a folder; name a file")
    folder = next(folder for folder in path.absolute().parents if folder.exists())
    if not (folder.is_dir() and os.access(folder, os.W_OK)):
        raise ConfigError(f"FILE {path}: {folder} is not a writable folder")

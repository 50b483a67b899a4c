"""`inhabit video`: a recording, or a run's policy in a few trials, as mp4 and filmstrip."""

import dataclasses
from pathlib import Path

from console import outputs
from console.commands import Video
from console.evaluation import tracking, trials
from console.evaluation.command import objects_of
from console.recording import format as recording
from console.recording.format import Recording
from console.run import assembly, machine
from console.run.directory import checkpoint_folder
from console.terminal import counted, doing, progress
from console.video import rendering
from console.video.drawing import Look
from policy.checkpoints import lineage
from policy.checkpoints.format import read_manifest
from world import tasks
from world.character.model import CONTROL_HZ
from world.errors import ConfigError

#: Fields that say which trials are simulated.
_SIMULATED = ("seconds", "objects", "near_m", "far_m", "seed")


def video_command(command: Video) -> int:
    """Write the video, the filmstrip or both; return the exit code."""
    if command.out is None and command.sheet is None:
        raise ConfigError("nothing to write: give OUT.mp4, or a filmstrip by --sheet FILE.png")
    if command.trials < 1:
        raise ConfigError("--trials must be at least 1")
    outputs.check(command.out, "OUT", (".mp4", *rendering.ANIMATED))
    outputs.check(command.sheet, "--sheet", (".png",))
    trials.require_distances(command.near_m, command.far_m)
    if command.out is not None and command.out.suffix.lower() == ".mp4":
        for flag, pixels in (("--width", command.width), ("--height", command.height)):
            if pixels % 2:
                raise ConfigError(f"{flag} {pixels}: an .mp4 needs even sizes; give {pixels + 1}")
    rendering.require_gl()
    if command.source.is_file():
        _refuse_trials(command, "a recording, whose trials are simulated already")
        found = recording.read(command.source)
        found = Recording(found.takes[: command.trials], found.meta)
    else:
        found = with_terms(played(command), command.source)
    shown = counted(len(found.takes), "trial")
    if command.out is not None:
        look = Look(command.width, command.height, command.look, command.captions)
        with progress("images", rendering.image_count(found), "drawing") as update:
            frames = rendering.write_video(
                found,
                command.out,
                look,
                progress=update,
                threads=command.threads or machine.cores(),
            )
        print(f"{command.out}: {counted(frames, 'frame')}, {shown}")
    if command.sheet is not None:
        with doing("drawing the filmstrip"):
            rendering.write_filmstrip(found, command.sheet)
        print(f"{command.sheet}: {shown}")
    return 0


def _refuse_trials(command: Video, what: str) -> None:
    """Raise ConfigError for a flag that chooses simulated trials, where none can be chosen."""
    for field in dataclasses.fields(command):
        if field.name in _SIMULATED and getattr(command, field.name) != field.default:
            flag = f"--{field.name.replace('_', '-')} {getattr(command, field.name)}"
            raise ConfigError(
                f"{flag}: {command.source} is {what}: leave it out, and choose how many are shown"
                " by --trials"
            )


def with_terms(found: Recording, source: Path) -> Recording:
    """Return a recording that says what its policy was trained on, and under which terms."""
    notes = read_manifest(checkpoint_folder(source)).notes
    terms = {"trained_on": lineage.data(notes), "licence": lineage.licence(notes)}
    return Recording(found.takes, found.meta | terms)


def played(command: Video) -> Recording:
    """Return a recording of a policy in the trials of a seed."""
    source = assembly.trained(command.source)
    threads = command.threads or machine.cores()
    if tasks.make(source.task).affordance.follows_clips:
        _refuse_trials(command, "a policy that follows clips, each in a trial of its length")
        if line := tracking.notice(source):
            print(line)
        return tracking.shown(source, command.trials, threads)
    limit_s = command.seconds or tasks.make(source.task).evaluation.limit_s
    chosen = trials.manifest(
        objects_of(source, command.objects, command.trials, command.seed),
        command.trials,
        command.seed,
        command.near_m,
        command.far_m,
        source.experiment.world.scale,
    )
    results = trials.run(
        source.experiment.world,
        source.weights,
        chosen,
        round(limit_s * CONTROL_HZ),
        threads,
        record=command.trials,
    )
    return trials.recording(results, {"task": source.task, "checkpoint": str(source.path)})

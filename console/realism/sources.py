"""The motions of a policy, a recording or files, as clips with the objects that they use."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import torch

import pretrained
from console.commands import Evaluate, Realism
from console.evaluation import command as evaluation
from console.evaluation import tracking
from console.evaluation import trials as trials_of
from console.evaluation.presets import start_m
from console.evaluation.scores import Protocol
from console.recording import format as recording
from console.recording.format import Recording, Take
from console.run import assembly, machine
from console.terminal import note
from world import tasks
from world.character import features, kinematics
from world.character import model as character
from world.errors import ConfigError
from world.motions import load
from world.motions.clip import Clip
from world.motions.objects import BoxTrack
from world.motions.synthetic.walker import SOURCE
from world.motions.uses.use import ClipUse
from world.scene.target import BoxState
from world.tracking.target import TOUCH_M, gap_m

RECORDING_SUFFIX = ".msgpack"


def is_policy(source: Path) -> bool:
    """Return whether a path is a run directory, a checkpoint folder, or a policy's name."""
    if not source.exists():
        return pretrained.folder(str(source)) is not None
    return source.is_dir() and any(
        (source / name).exists() for name in ("config.json", "manifest.json", "checkpoints")
    )


def clips_of_policy(
    found: assembly.Trained, command: Realism, progress: Callable[[float], None]
) -> list[Clip]:
    """Return the motions of a policy's trials by the protocol: successes, failures and falls."""
    task = tasks.make(found.task)
    world, threads = found.experiment.world, command.threads or machine.cores()
    if task.affordance.follows_clips:
        bank = tracking.bank_of(world)
        chosen = tracking.manifest(bank, command.trials, command.seed)
        count = min(command.trials, tracking.SLOTS)
        outcomes = tracking.run(world, bank, found.weights, chosen, threads, count, progress)
        return clips_of_takes(outcomes.takes, found.task)
    near_m, far_m = start_m(found.task, "table1")
    protocol = Protocol(success_m=task.success_m, limit_s=task.evaluation.limit_s)
    wanted = Evaluate(
        found.path, trials=command.trials, seed=command.seed, near_m=near_m, far_m=far_m
    )
    pieces = evaluation.objects_of(found, "test", command.trials, command.seed)
    chosen = evaluation.manifest_of(found.task, pieces, wanted, protocol, world.scale)
    results = trials_of.run(
        world, found.weights, chosen, protocol.steps, threads, len(chosen), progress
    )
    return clips_of_takes(results.takes, found.task)


def clips_of_recording(path: Path) -> tuple[list[Clip], str]:
    """Return the motions of a recording, and its task."""
    read: Recording = recording.read(path)
    task = str(read.meta.get("task", ""))
    if task not in tasks.REGISTRY:
        raise ConfigError(f"{path}: recorded with task {task[:40]!r}, which is none of ours")
    return clips_of_takes(read.takes, task), task


def clips_of_takes(takes: Sequence[Take], task: str) -> list[Clip]:
    """Return takes as clips, whose objects are found as those of mocap are."""
    use = tasks.make(task).affordance.clips
    return [part for i, take in enumerate(takes) for part in use.fit(clip_of_take(take, f"{i}"))]


def clip_of_take(take: Take, name: str) -> Clip:
    """Return a take as a clip, with its box as it moved."""
    qpos = take.qpos[:, : character.NQ]
    return Clip(
        name=name,
        fps=character.CONTROL_HZ,
        root_position_m=qpos[:, :3].astype(np.float32),
        local_rotation=kinematics.local_rotations(torch.from_numpy(qpos)).float().numpy(),
        source="simulation",
        licence="",
        box=_box(take),
    )


def _box(take: Take) -> BoxTrack | None:
    if not len(take.cargo):
        return None
    qpos = torch.from_numpy(take.qpos).float()
    body = features.body(qpos[:, : character.NQ], torch.zeros(len(qpos), character.NV))
    pose = qpos[:, character.NQ :]
    half = torch.from_numpy(take.cargo).float().expand(len(qpos), 3)
    still = torch.zeros_like(pose[:, :3])
    box = BoxState(pose[:, :3], pose[:, 3:], still, half, still, still)
    held = (gap_m(body, box) < TOUCH_M).all(dim=1).numpy()
    x, y, z = (2.0 * take.cargo).tolist()
    return BoxTrack(pose.numpy(), (x, y, z), held)


def reference(clips: Sequence[Clip], paths: Sequence[str]) -> str:
    """Return what reference clips are, in words: clips that the package made are no mocap."""
    if all(clip.source == SOURCE for clip in clips):
        return assembly.OWN_CLIPS
    return f"clips of {', '.join(Path(path).name for path in paths)}"


def mocap(paths: Sequence[str], use: ClipUse, group: str) -> tuple[list[Clip], list[str]]:
    """Return mocap clips prepared for a use, and the group of each, which is never divided.

    group: `recording`, a group for each file; `folder`, one for each folder, as where a folder
    holds a subject.
    """
    if not paths:
        clips = load.clips((), use)
        return clips, [clip.name for clip in clips]
    clips, groups = [], []
    note(load.note_others(paths))
    for path in load.find(paths):
        parts = use.prepare(load.read(path))
        clips += parts
        groups += [str(path.parent if group == "folder" else path)] * len(parts)
    return clips, groups

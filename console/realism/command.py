"""`inhabit realism`: motions measured relative to held-out reference clips."""

from typing import Any

import torch
from rich.table import Table

from console.commands import Realism
from console.evaluation.tables import number
from console.realism import sources
from console.run import assembly
from console.run.directory import write_json
from console.terminal import doing, note, progress, screen
from world import tasks
from world.errors import ConfigError
from world.motions import load
from world.motions.clip import Clip
from world.realism import phases, relative


def realism_command(command: Realism) -> int:
    """Measure, print the table, write the JSON; return the exit code."""
    torch.set_num_threads(1)  # the classifier's matrices are too small for more
    clips, task, against = _motions(command)
    output = screen()
    use = tasks.make(task).affordance.clips
    mocap, groups = sources.mocap(against, use, command.group)
    if command.noise_rad:
        clips = phases.noised(clips, command.noise_rad, command.seed)
    if not clips:
        raise ConfigError(f"{command.source}: no motion to measure")
    reference = sources.reference(mocap, against)
    with output.status(f"comparing with {reference}"), doing(f"comparing with {reference}"):
        found = relative.compare(clips, mocap, groups, command.folds, command.seed)
    output.print(table(found, f"{command.source.name}: {len(clips)} motions, {task}"))
    output.print(
        "each cell: value (ratio to the held-out reference clips); 1 is as they are. "
        f"Reference: {reference}, {len(set(groups))} {command.group}s, halved {command.folds} times"
    )
    if command.json is not None:
        write_json(command.json, figures(found, command, task, reference, len(set(groups))))
    return 0


def _motions(command: Realism) -> tuple[list[Clip], str, tuple[str, ...]]:
    """Return the motions to measure, their task, and the paths of the reference clips."""
    against = tuple(str(path) for path in command.against)
    source = command.source
    if sources.is_policy(source):
        found = assembly.trained(source)
        with progress("trials", command.trials, "simulating") as update:
            clips = sources.clips_of_policy(found, command, update)
        return clips, found.task, against or found.experiment.world.motions
    if source.suffix == sources.RECORDING_SUFFIX:
        clips, task = sources.clips_of_recording(source)
        return clips, task, against
    task = tasks.make(command.task)
    note(load.note_others((str(source),)))
    return load.clips((str(source),), task.affordance.clips), command.task, against


def table(found: dict[str, relative.Phase], title: str) -> Table:
    """Return the measures of all phases as a table."""
    shown = Table("measure", *phases.PHASES, title=title, title_justify="left")
    seconds = [f"{found[phase].seconds[0]:.0f}" for phase in phases.PHASES]
    shown.add_row("duration, s", *seconds)
    for name, (meaning, unit) in relative.MEASURES.items():
        cells = []
        for phase in phases.PHASES:
            value = found[phase].values[name]
            ratio = f" ({value.ratio:.2f})" if value.ratio is not None else ""
            cells.append(f"{number(value.motion, 1.0, 2)}{ratio}")
        shown.add_row(f"{meaning}{', ' + unit if unit else ''}", *cells)
    return shown


def figures(
    found: dict[str, relative.Phase], command: Realism, task: str, reference: str, groups: int
) -> dict[str, Any]:
    """Return the measures as JSON values."""
    return {
        "source": command.source.name,
        "task": task,
        "trials": command.trials if sources.is_policy(command.source) else None,
        "seed": command.seed,
        "folds": command.folds,
        "group": command.group,
        "reference": reference,
        "noise_rad": command.noise_rad,
        "groups": groups,
        "phases": {
            phase: {
                "seconds": dict(zip(("motion", "held_out", "reference"), one.seconds, strict=True)),
                "values": {
                    name: {"motion": value.motion, "mocap": value.mocap, "ratio": value.ratio}
                    for name, value in one.values.items()
                },
            }
            for phase, one in found.items()
        },
    }

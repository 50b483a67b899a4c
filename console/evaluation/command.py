"""`inhabit evaluate`: the paper's protocol on furniture never trained on, as tables and JSON."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rich.progress import Progress

from console.commands import Evaluate
from console.evaluation import tracking, trials
from console.evaluation.arrangement import boxes
from console.evaluation.presets import PRESETS
from console.evaluation.realism import quality_of
from console.evaluation.scores import Protocol, by_stage, judge, summarise
from console.evaluation.stepping import Trials
from console.evaluation.style_judge import judge_of
from console.evaluation.tables import tables
from console.recording import format as recording
from console.run import assembly, machine
from console.run.directory import run_of, write_json
from console.terminal import screen
from world import tasks
from world.config import WorldConfig
from world.errors import ChoiceError, ClipError, ConfigError
from world.furniture import collection
from world.furniture.piece import Affordance, Piece
from world.motions.library import MotionLibrary
from world.scene import perturbations
from world.tasks.task import HELD
from world.tasks.track import follows

SPLITS = ("test", "train")


def pieces_of(objects: str, seed: int, affordance: Affordance = "sit") -> tuple[Piece, ...]:
    """The pieces of a split of the package's catalogue, or those of imported ones that can be used.

    Raises ChoiceError, which lists the splits, for a path that is not there; PieceError where none
    of its pieces can be sat or lain on.
    """
    if objects == "test":
        return assembly.pieces_for(affordance, "test", None, seed)
    if objects == "train":
        return assembly.pieces_for(affordance, "train", None, seed)
    if not Path(objects).exists():
        raise ChoiceError("--objects", objects, [*SPLITS, "a folder of pieces"])
    return collection.usable(collection.pieces([objects]), affordance, objects)


def objects_of(found: assembly.Trained, objects: str, number: int, seed: int) -> tuple[Piece, ...]:
    """What a policy is tried on in `number` trials: pieces of a split in turn, or a box a trial."""
    affordance = tasks.make(found.task).affordance
    if affordance == "carry":
        if objects != "test":
            raise ConfigError("--objects: carry draws a box for each trial; leave it out")
        return boxes(number, seed, found.experiment.world.carry.weight_kg)
    return pieces_of(objects, 0, affordance)


def evaluate_command(command: Evaluate) -> int:
    """Evaluate, print the tables, write the JSON; returns the exit code."""
    check(command)
    found = assembly.trained(command.source)
    if follows(tasks.make(found.task)):
        return follow(command, found)
    pieces = objects_of(found, command.objects, command.trials, command.seed)
    library = clips(command, found.experiment.world) if command.quality else None
    output = screen()
    with Progress(console=output, transient=True, disable=not output.is_terminal) as bar:
        row = bar.add_task("trials", total=command.trials)
        figures, results = evaluate(
            found,
            pieces,
            command,
            library,
            lambda done: bar.update(row, completed=done),
        )
    for table in tables(figures):
        output.print(table)
    run = run_of(found.path)
    if run is not None:
        write_json(run.evaluations / file_name(found.path.name, figures), figures)
    if command.json is not None:
        write_json(command.json, figures)
    if command.record is not None:
        meta = {"task": found.task, "checkpoint": str(found.path), "seed": command.seed}
        takes = trials.recording(results, meta)
        kept = recording.Recording(takes.takes[: command.record_trials], takes.meta)
        recording.write(command.record, kept)
    return 0


def follow(command: Evaluate, found: assembly.Trained) -> int:
    """Evaluate how well clips are followed, print the table, write the JSON."""
    if command.perturb != "none" or command.objects != "test":
        raise ConfigError("--perturb and --objects: a policy that follows clips has what they use")
    motions = tuple(str(path.resolve()) for path in command.motions)
    output = screen()
    with Progress(console=output, transient=True, disable=not output.is_terminal) as bar:
        row = bar.add_task("trials", total=command.trials)
        figures, takes = tracking.evaluate(
            found,
            motions,
            command.trials,
            command.seed,
            command.threads or machine.cores(),
            command.record_trials if command.record else 0,
            lambda done: bar.update(row, completed=done),
        )
    output.print(tracking.table(figures))
    run = run_of(found.path)
    if run is not None:
        write_json(run.evaluations / file_name(found.path.name, figures), figures)
    if command.json is not None:
        write_json(command.json, figures)
    if command.record is not None:
        meta = {"task": found.task, "checkpoint": str(found.path), "seed": command.seed}
        recording.write(command.record, recording.Recording(takes, {"control_hz": 30, **meta}))
    return 0


def check(command: Evaluate) -> Evaluate:
    """The command, or ConfigError where its flags make no sense."""
    near_m, far_m = distances(command)
    if command.trials < 1 or command.record_trials < 1:
        raise ConfigError("--trials and --record-trials must be at least 1")
    if command.quality < 0:
        raise ConfigError("--quality must be 0 or more")
    if not 0 < near_m <= far_m:
        raise ConfigError("--near-m must be above 0 and no more than --far-m")
    return command


def distances(command: Evaluate) -> tuple[float, float]:
    """Where the trials start, m: the preset's, unless said otherwise."""
    preset = PRESETS[command.preset]
    return (
        preset.near_m if command.near_m is None else command.near_m,
        preset.far_m if command.far_m is None else command.far_m,
    )


def file_name(checkpoint: str, figures: dict[str, Any]) -> str:
    """The name of an evaluation's file in its run: what makes it another one."""
    parts = [checkpoint, figures["objects"]]
    if figures["perturbation"] != "none":
        parts.append(figures["perturbation"])
    if figures["preset"] != "table1":
        parts.append(figures["preset"])
    return "-".join([*parts, str(figures["seed"]), str(figures["trials"])]) + ".json"


def clips(command: Evaluate, world: WorldConfig) -> MotionLibrary | None:
    """The yardstick's motions: those named, or those that the policy was trained on where they are
    still there; None where they are gone."""
    if command.motions:
        paths = tuple(str(path) for path in command.motions)
        return assembly.library(paths, world.mirror, world.task)
    try:
        return assembly.library_of(world)
    except ClipError as error:
        screen().print(f"no mocap to compare with ({error}); name some with --motions")
        return None


def manifest_of(
    pieces: Sequence[Piece], command: Evaluate, protocol: Protocol, scale: tuple[float, float]
) -> Trials:
    """The trials that a command asks for."""
    near_m, far_m = distances(command)
    disturbance = perturbations.draw(
        command.perturb, command.trials, command.seed, protocol.limit_steps
    )
    return trials.manifest(pieces, command.trials, command.seed, near_m, far_m, scale, disturbance)


def evaluate(
    found: assembly.Trained,
    pieces: tuple[Piece, ...],
    command: Evaluate,
    library: MotionLibrary | None = None,
    progress: Callable[[int], None] = lambda done: None,
) -> tuple[dict[str, Any], trials.Results]:
    """The evaluation JSON of console.md, and what happened in each trial."""
    began = time.perf_counter()
    world = found.experiment.world
    task = tasks.make(found.task)
    protocol = Protocol(success_m=task.success_m)
    chosen = manifest_of(pieces, command, protocol, world.scale)
    style = judge_of(found) if command.quality else None
    record = max(command.quality, command.record_trials if command.record else 0)
    results = trials.run(
        world,
        found.weights,
        chosen,
        protocol.steps,
        command.threads or machine.cores(),
        min(record, len(chosen)),
        progress,
    )
    figures = {
        "task": found.task,
        "checkpoint": str(found.path),
        "iteration": found.manifest.iteration,
        "samples": found.manifest.samples,
        "trials": command.trials,
        "seed": command.seed,
        # of a folder its name: figures are passed on, paths are not
        "objects": Path(command.objects).name,
        "perturbation": command.perturb,
        "preset": command.preset,
        "start_m": list(distances(command)),
        **scored(results, chosen, protocol, task.stages),
    }
    if command.quality:
        tracks = results.tracks[: command.quality]
        figures["quality"] = quality_of(tracks, world, library, pieces, style, command.seed)
    return figures | {"wall_s": time.perf_counter() - began}, results


def scored(
    results: trials.Results, chosen: Trials, protocol: Protocol, stages: Sequence[str]
) -> dict[str, Any]:
    """What the trials gave, as figures."""
    outcomes = judge(results.error_m, results.fell_at, protocol)
    figures = summarise(outcomes, [p.name for p in chosen.pieces], chosen.distance_m)
    reached = by_stage(results.reached, stages)
    held = by_stage(outcomes.held[:, None], [HELD])
    figures |= {
        "by_stage": reached + held,
        "by_class": by_class(outcomes.success.tolist(), chosen.pieces),
        "broken": results.broken,
    }
    what = chosen.disturbance
    if what.kind == "projectiles":
        how = what.throwing
        figures["projectiles"] = {
            "count": how.count,
            "mass_kg": how.ball.mass_kg,
            "radius_m": how.ball.radius_m,
            "speed_m_s": how.speed_m_s,
            "thrown_per_trial": float(results.disturbed.mean()),
        }
    if what.kind == "moved":
        how = what.moving
        figures["moved"] = {
            "near_m": list(how.near_m),
            "shift_m": list(how.shift_m),
            "turn_deg": round(how.turn_rad * 180 / 3.141592653589793, 1),
            "share_moved": float(results.disturbed.mean()),
        }
    return figures


def by_class(success: list[bool], pieces: tuple[Piece, ...]) -> list[dict[str, Any]]:
    """Success by class of furniture."""
    found: dict[str, list[bool]] = {}
    for hit, piece in zip(success, pieces, strict=True):
        found.setdefault(piece.category, []).append(hit)
    return [
        {"class": name, "trials": len(hits), "success": sum(hits) / len(hits)}
        for name, hits in sorted(found.items())
    ]

"""`inhabit evaluate`: the paper's protocol on held-out furniture, as tables and JSON."""

import hashlib
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from console.commands import Evaluate, Report
from console.evaluation import tracking, trials
from console.evaluation.presets import start_m
from console.evaluation.realism import quality_of
from console.evaluation.scores import Protocol, by_stage, judge, summarise, wilson
from console.evaluation.stepping import Trials
from console.evaluation.style_judge import judge_of
from console.evaluation.tables import tables
from console.recording import format as recording
from console.run import assembly, machine
from console.run.directory import run_of, write_json
from console.terminal import doing, progress, screen
from policy.checkpoints import lineage
from world import tasks
from world.affordances.box import WEIGHTS
from world.character.model import CONTROL_HZ
from world.config import WorldConfig
from world.errors import ClipError, ConfigError, InhabitError
from world.furniture.piece import Piece
from world.meshes import held_out
from world.meshes.collection import SPLITS
from world.motions.library import MotionLibrary
from world.scene import perturbations
from world.tasks.task import HELD


def objects_of(found: assembly.Trained, objects: str, number: int, seed: int) -> tuple[Piece, ...]:
    """Return the objects of `number` trials: pieces of a split in turn, or a box per trial."""
    affordance = tasks.make(found.task).affordance
    return affordance.trial_pieces(objects, number, seed, found.experiment.world)


def chosen_pieces(command: Evaluate, found: assembly.Trained) -> tuple[Piece, ...]:
    """Return the objects of a command's trials."""
    objects = command.objects
    if command.preset == WEIGHTS:
        if not tasks.make(found.task).affordance.cargo or objects != "test":
            raise ConfigError("--preset weights: is of carry and draws its own boxes")
        objects = WEIGHTS
    pieces = objects_of(found, objects, command.trials, command.seed)
    if not command.held_out:
        return pieces
    if command.objects in SPLITS:
        raise ConfigError("--held-out: is of imported pieces: add --objects with their folder")
    return held_out.held(pieces, Path(command.objects))


Then = Callable[[assembly.Trained, Sequence[Piece], dict[str, Any], trials.Results], None]
"""Takes the policy, its pieces, figures and results, after they are printed and written."""


def evaluate_command(command: Evaluate, then: Then | None = None) -> int:
    """Evaluate, print the tables, write the JSON; return the exit code.

    then: called at the end, but not for a task that follows clips.
    """
    found = assembly.trained(command.source, command.task)
    check(command, found.task)
    if tasks.make(found.task).affordance.follows_clips:
        return evaluate_tracking(command, found)
    with doing("reading pieces and clips"):
        pieces = chosen_pieces(command, found)
        library = clips(command, found.experiment.world) if command.quality else None
    output = screen()
    if strange := unfamiliar(found.experiment.world, pieces):
        output.print(f"note: not trained on pieces of the class {', '.join(strange)}")
    with progress("trials", command.trials, "simulating") as update:
        figures, results = evaluate(
            found,
            pieces,
            command,
            library,
            update,
        )
    for table in tables(figures):
        output.print(table)
    run = run_of(found.path)
    if run is not None:
        write_json(run.evaluations / file_name(found.path.name, figures), figures)
    if command.json is not None:
        write_json(command.json, figures)
    if command.record is not None:
        meta = recording_meta(command, found)
        takes = trials.recording(results, meta)
        kept = recording.Recording(takes.takes[: command.record_trials], takes.meta)
        recording.write(command.record, kept)
    if then is not None:
        then(found, pieces, figures, results)
    return 0


def evaluate_tracking(command: Evaluate, found: assembly.Trained) -> int:
    """Evaluate the tracking of clips, print the table, write the JSON; return the exit code."""
    if command.worst:
        raise ConfigError("--worst: this task follows clips; leave it out, and see play")
    output = screen()
    if line := tracking.notice(found, command.motions):
        output.print(line)
    figures, takes = followed(command, found, command.record_trials if command.record else 0)
    output.print(tracking.table(figures))
    run = run_of(found.path)
    if run is not None:
        write_json(run.evaluations / file_name(found.path.name, figures), figures)
    if command.json is not None:
        write_json(command.json, figures)
    if command.record is not None:
        meta = {"control_hz": CONTROL_HZ, **recording_meta(command, found)}
        recording.write(command.record, recording.Recording(takes, meta))
    return 0


def followed(
    command: Evaluate | Report, found: assembly.Trained, record: int
) -> tuple[dict[str, Any], list[recording.Take]]:
    """Return the figures of a policy that follows clips, and the takes of its first `record`
    trials; ConfigError for options that have no meaning here."""
    if command.perturb != "none" or command.objects != "test":
        raise ConfigError("--perturb, --objects: this task follows clips; leave them out")
    motions = tuple(str(path.resolve()) for path in command.motions)
    threads = command.threads or machine.cores()
    with progress("trials", command.trials, "simulating") as update:
        return tracking.evaluate(
            found, motions, command.trials, command.seed, threads, record, update
        )


def unfamiliar(world: WorldConfig, pieces: Sequence[Piece]) -> list[str]:
    """Return the classes of pieces that the training had none of; empty where its furniture is not
    at hand."""
    try:
        trained, _ = assembly.training_pieces(world)
    except InhabitError:
        return []
    if not trained:  # the task makes its own objects
        return []
    return sorted({piece.category for piece in pieces} - {piece.category for piece in trained})


def recording_meta(command: Evaluate, found: assembly.Trained) -> dict[str, object]:
    """Return what a recording says of its policy, with the terms of its training data."""
    return {
        "task": found.task,
        "checkpoint": str(found.path),
        "seed": command.seed,
        "trained_on": lineage.data(found.manifest.notes),
        "licence": lineage.licence(found.manifest.notes),
    }


def check(command: Evaluate, task: str) -> Evaluate:
    """Return the command; ConfigError for invalid flags."""
    near_m, far_m = distances(command, task)
    if command.trials < 1 or command.record_trials < 1:
        raise ConfigError("--trials and --record-trials must be at least 1")
    if bool(command.worst) != (command.out is not None):
        raise ConfigError("--worst and --out belong together: --worst 20 --out worst.html")
    if command.quality < 0:
        raise ConfigError("--quality must be 0 or more")
    trials.require_distances(near_m, far_m)
    return command


def distances(command: Evaluate, task: str) -> tuple[float, float]:
    """Return the smallest and largest initial distance of the trials, m: the flags, else the
    protocol's."""
    near_m, far_m = start_m(task, command.preset)
    return (
        near_m if command.near_m is None else command.near_m,
        far_m if command.far_m is None else command.far_m,
    )


def file_name(checkpoint: str, figures: dict[str, Any]) -> str:
    """Return the name of an evaluation's file in its run, distinct for distinct settings."""
    parts = [checkpoint, figures["objects"]]
    if figures.get("held_out"):
        parts.append("held-out")
    if figures["perturbation"] != "none":
        parts.append(figures["perturbation"])
    if figures["preset"] != "table1":
        parts.append(figures["preset"])
    near_m, far_m = figures.get("start_m", start_m(figures["task"], figures["preset"]))
    if (near_m, far_m) != start_m(figures["task"], figures["preset"]):
        parts.append(f"{near_m:g}-{far_m:g}m")
    if "simulator" in figures:
        parts.append(figures["simulator"])
    if "motions" in figures:
        parts.append(hashlib.sha256("/".join(figures["motions"]).encode()).hexdigest()[:8])
    return "-".join([*parts, str(figures["seed"]), str(figures["trials"])]) + ".json"


def clips(command: Evaluate, world: WorldConfig) -> MotionLibrary | None:
    """Return the reference motions: the clips of the flags, else the training clips; None if the
    training clips are missing."""
    if command.motions:
        paths = tuple(str(path) for path in command.motions)
        return assembly.library(paths, world.mirror, world.task)
    try:
        return assembly.library_of(world)
    except ClipError as error:
        screen().print(f"no mocap to compare with ({error}): give clips by --motions")
        return None


def clips_named(command: Evaluate, found: assembly.Trained) -> str:
    """Return what the motion quality is compared with, in a few words.

    A published policy records no paths of clips, so that the package's own clips stand in for those
    that it was trained on: the words say so.
    """
    if command.motions:
        names = ", ".join(path.name for path in command.motions[:3])
        more = len(command.motions) - 3
        return f"clips of {names}" + (f" and {more} more" if more > 0 else "")
    if found.experiment.world.motions:
        return "the training clips"
    own = any(one.what == assembly.OWN_CLIPS for one in lineage.of(found.manifest.notes))
    # a run records the paths of its clips, a published folder says what it was trained on
    published = "licence" in found.manifest.notes
    unlike = ", not the training clips" if published and not own else ""
    return assembly.OWN_CLIPS + unlike


def manifest_of(
    task: str,
    pieces: Sequence[Piece],
    command: Evaluate,
    protocol: Protocol,
    scale: tuple[float, float],
) -> Trials:
    """Return the trials of a command."""
    near_m, far_m = distances(command, task)
    disturbance = perturbations.draw(
        command.perturb, command.trials, command.seed, protocol.limit_steps
    )
    return trials.manifest(pieces, command.trials, command.seed, near_m, far_m, scale, disturbance)


def evaluate(
    found: assembly.Trained,
    pieces: tuple[Piece, ...],
    command: Evaluate,
    library: MotionLibrary | None = None,
    progress: Callable[[float], None] = lambda done: None,
) -> tuple[dict[str, Any], trials.Results]:
    """Return the evaluation JSON, and the results of each trial."""
    began = time.perf_counter()
    world = found.experiment.world
    task = tasks.make(found.task)
    protocol = Protocol(success_m=task.success_m, limit_s=task.evaluation.limit_s)
    chosen = manifest_of(found.task, pieces, command, protocol, world.scale)
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
        command.simulator,
    )
    figures = {
        "task": found.task,
        "checkpoint": str(found.path),
        "iteration": found.manifest.iteration,
        "samples": found.manifest.samples,
        "trials": command.trials,
        "seed": command.seed,
        # the name of a folder alone: figures are passed on, paths of this machine are not
        "objects": Path(command.objects).name,
        **({"held_out": True} if command.held_out else {}),
        "perturbation": command.perturb,
        "preset": command.preset,
        **({} if command.simulator == "mujoco" else {"simulator": command.simulator}),
        "start_m": list(distances(command, found.task)),
        "pieces": len({piece.name for piece in pieces}),
        **scored(results, chosen, protocol, task.stages),
    }
    if command.quality:
        tracks = results.tracks[: command.quality]
        with doing("measuring motion quality"):
            figures["quality"] = quality_of(tracks, world, library, pieces, style, command.seed)
        named = None if library is None else clips_named(command, found)
        figures["quality"]["compared_with"] = named
    return figures | {"wall_s": time.perf_counter() - began}, results


def scored(
    results: trials.Results, chosen: Trials, protocol: Protocol, stages: Sequence[str]
) -> dict[str, Any]:
    """Return the results of the trials as figures."""
    outcomes = judge(results.error_m, results.fell_at, protocol)
    figures = summarise(outcomes, [p.name for p in chosen.pieces], chosen.distance_m)
    reached = by_stage(results.reached, stages)
    held = by_stage(outcomes.held[:, None], [HELD])
    figures |= {
        "by_stage": reached + held,
        "by_class": by_class(outcomes.success.tolist(), chosen.pieces),
        "broken": results.broken,
    }
    disturbance = chosen.disturbance
    if disturbance.kind == "projectiles":
        how = disturbance.throwing
        figures["projectiles"] = {
            "count": how.count,
            "mass_kg": how.ball.mass_kg,
            "radius_m": how.ball.radius_m,
            "speed_m_s": how.speed_m_s,
            "thrown_per_trial": float(results.disturbed.mean()),
        }
    if disturbance.kind == "moved":
        how = disturbance.moving
        figures["moved"] = {
            "near_m": list(how.near_m),
            "shift_m": list(how.shift_m),
            "turn_deg": round(how.turn_rad * 180 / 3.141592653589793, 1),
            "share_moved": float(results.disturbed.mean()),
        }
    return figures


def by_class(success: list[bool], pieces: tuple[Piece, ...]) -> list[dict[str, Any]]:
    """Return the success rate by category of furniture."""
    found: dict[str, list[bool]] = {}
    for hit, piece in zip(success, pieces, strict=True):
        found.setdefault(piece.category, []).append(hit)
    return [
        {
            "class": name,
            "trials": len(hits),
            "success": sum(hits) / len(hits),
            "ci95": list(wilson(sum(hits), len(hits))),
        }
        for name, hits in sorted(found.items())
    ]

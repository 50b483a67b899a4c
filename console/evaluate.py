"""`inhabit evaluate`: the paper's protocol on pieces of furniture, as a table and as JSON."""

import time
from typing import Any

from rich.progress import Progress
from rich.table import Table

from console import assembly, machine, recording, trials
from console.commands import Evaluate
from console.runs import run_of, write_json
from console.scores import Protocol, judge, summarise
from console.screen import screen
from world import tasks
from world.errors import ChoiceError, ConfigError
from world.furniture.catalogue import catalogue
from world.furniture.piece import Piece

#: The paper's Table 1: success %, time s, precision cm.
PAPER = {"sit": (90.4, 5.0, 6.7)}
SPLITS = ("test", "train")


def pieces_of(split: str, seed: int) -> tuple[Piece, ...]:
    """The pieces of a split of the package's catalogue; ChoiceError lists the splits."""
    if split == "test":
        return catalogue("test", seed=seed)
    if split == "train":
        return catalogue("train", seed=seed)
    raise ChoiceError("--objects", split, list(SPLITS))


def evaluate_command(command: Evaluate) -> int:
    """Evaluate, print the table, write the JSON; returns the exit code."""
    if command.trials < 1 or command.record_trials < 1:
        raise ConfigError("--trials and --record-trials must be at least 1")
    if not 0 < command.near_m <= command.far_m:
        raise ConfigError("--near-m must be above 0 and no more than --far-m")
    pieces = pieces_of(command.objects, 0)
    found = assembly.trained(command.source)
    output = screen()
    with Progress(console=output, transient=True, disable=not output.is_terminal) as bar:
        row = bar.add_task("trials", total=command.trials)
        figures, takes = evaluate(
            found,
            pieces,
            command,
            lambda done: bar.update(row, completed=done),
        )
    output.print(table(figures, found.task))
    run = run_of(found.path)
    if run is not None:
        name = f"{found.path.name}-{command.objects}-{command.seed}-{command.trials}.json"
        write_json(run.evaluations / name, figures)
    if command.json is not None:
        write_json(command.json, figures)
    if command.record is not None:
        meta = {"task": found.task, "checkpoint": str(found.path), "seed": command.seed}
        recording.write(command.record, trials.recording(takes, meta))
    return 0


def evaluate(
    found: assembly.Trained,
    pieces: tuple[Piece, ...],
    command: Evaluate,
    progress: Any = lambda done: None,
) -> tuple[dict[str, Any], trials.Results]:
    """The evaluation JSON of console.md, and what happened in each trial."""
    began = time.perf_counter()
    protocol = Protocol(success_m=tasks.make(found.task).success_m)
    world = found.experiment.world
    chosen = trials.manifest(
        pieces, command.trials, command.seed, command.near_m, command.far_m, world.scale
    )
    results = trials.run(
        world,
        found.weights,
        chosen,
        protocol.steps,
        command.threads or machine.cores(),
        command.record_trials if command.record else 0,
        progress,
    )
    outcomes = judge(results.error_m, results.fell_at, protocol)
    figures = {
        "task": found.task,
        "checkpoint": str(found.path),
        "iteration": found.manifest.iteration,
        "samples": found.manifest.samples,
        "trials": command.trials,
        "seed": command.seed,
        "objects": command.objects,
        "perturbation": command.perturb,
        "start_m": [command.near_m, command.far_m],
        **summarise(outcomes, [p.name for p in chosen.pieces], chosen.distance_m),
        "by_class": by_class(outcomes.success.tolist(), chosen.pieces),
        "broken": results.broken,
        "wall_s": time.perf_counter() - began,
    }
    return figures, results


def by_class(success: list[bool], pieces: tuple[Piece, ...]) -> list[dict[str, Any]]:
    """Success by class of furniture."""
    found: dict[str, list[bool]] = {}
    for hit, piece in zip(success, pieces, strict=True):
        found.setdefault(piece.category, []).append(hit)
    return [
        {"class": name, "trials": len(hits), "success": sum(hits) / len(hits)}
        for name, hits in sorted(found.items())
    ]


def table(figures: dict[str, Any], task: str) -> Table:
    """The figures in the shape of the paper's Table 1, its row beneath ours."""
    shown = Table(
        "", "success %", "95 %", "sustained %", "time s", "precision cm", "falls %",
        title=f"{task}: {figures['trials']} trials, {figures['objects']} pieces, "
        f"{figures['start_m'][0]:g}-{figures['start_m'][1]:g} m, {figures['wall_s']:.0f} s",
        title_justify="left",
    )  # fmt: skip

    def number(value: float | None, scale: float = 1.0) -> str:
        return "-" if value is None else f"{scale * value:.1f}"

    low, high = figures["success"]["ci95"]
    shown.add_row(
        "all",
        number(figures["success"]["rate"], 100),
        f"{100 * low:.1f}-{100 * high:.1f}",
        number(figures["sustained"]["rate"], 100),
        number(figures["time_s"]),
        number(figures["precision_m"], 100),
        number(figures["falls"], 100),
    )
    if task in PAPER:
        success, seconds, precision = PAPER[task]
        shown.add_row("paper", f"{success}", "", "", f"{seconds}", f"{precision}", "")
    shown.add_section()
    for part in figures["by_distance"]:
        name = f"{part['from_m']:g}-{part['to_m']:g} m ({part['trials']})"
        shown.add_row(name, number(part["success"], 100))
    shown.add_section()
    for part in figures["by_class"]:
        shown.add_row(f"{part['class']} ({part['trials']})", number(part["success"], 100))
    return shown

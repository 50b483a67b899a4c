"""`inhabit report`: a page of a run's metrics, evaluations and newly recorded trials."""

import itertools
import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from console import existing
from console.commands import Evaluate, Report
from console.evaluation.command import check, clips, evaluate, objects_of
from console.evaluation.realism import style_rewards
from console.evaluation.scores import Outcomes, Protocol, judge
from console.evaluation.stepping import Track
from console.evaluation.style_judge import StyleJudge, judge_of
from console.evaluation.trials import Results
from console.kinds import kind
from console.report import followed, page, pictures
from console.report.scene3d import drawable
from console.run import assembly
from console.run.directory import RunDirectory, run_of, write_text
from console.run.experiment import to_json
from console.run.metrics import read_metrics
from console.terminal import counted, doing, progress
from policy.checkpoints import lineage
from world import tasks
from world.errors import ConfigError
from world.furniture.piece import Piece


def report_command(command: Report) -> int:
    """Write the page; return the exit code."""
    found = assembly.trained(command.source)
    run = run_of(found.path)
    folder = found.path if run is None else run.path
    # no file is written into the folder of a published policy
    out = command.out or (run.path / "report.html" if run else Path(f"{folder.name}-report.html"))
    existing.require(out, "" if command.out is None else "--out ", existing.PAGE)
    task = tasks.make(found.task)
    metrics = tuple(read_metrics(folder / "metrics.jsonl"))
    settings = to_json(found.experiment) | {"world": settings_of(found)}
    if command.trials < 3:
        raise ConfigError("--trials must be at least 3: the best, a median and the worst")
    if task.affordance.follows_clips:
        written(out, followed.text(command, found, metrics, settings), command.trials)
        return 0
    pieces = objects_of(found, command.objects, command.trials, command.seed)
    evaluation = evaluation_of(command, found.task)
    library = clips(evaluation, found.experiment.world)
    with progress("trials", command.trials, "simulating") as update:
        figures, results = evaluate(found, pieces, evaluation, library, update)
    protocol = Protocol(success_m=task.success_m, limit_s=task.evaluation.limit_s)
    known = evaluations(folder, run)
    own = ("trials of this report", figures)
    main = headline([figures for _, figures in known], figures)
    draws = pictures.can_draw()
    with doing("reading the discriminator"):
        judge_style = judge_of(found)
    pictured = pieces_of(main, pieces) if draws and kind(task).pictured else []
    with progress("pictures", 3 + len(pictured), "drawing") as update:
        drawn = itertools.count(1)

        def one_more() -> None:
            update(next(drawn))

        content = page.Report(
            title=f"inhabit {found.task}: {folder.name}",
            subtitle=f"Checkpoint {found.path.name}, {found.manifest.samples / 1e6:.1f} M samples."
            f" Trained on: {lineage.data(found.manifest.notes)}."
            f" Licence: {lineage.licence(found.manifest.notes)}",
            main=main,
            evaluations=(*known, own),
            metrics=metrics,
            quality=figures.get("quality"),
            trials=tuple(shown(results, protocol, judge_style, draws, one_more)),
            pictures=pictures_of(pictured, one_more),
            settings=settings,
        )
        text = page.page(content)
    written(out, text, command.trials)
    return 0


def written(out: Path, text: str, trials: int) -> None:
    """Write a page of so many trials, and say so."""
    write_text(out, text)
    print(f"{out}: {len(text) / 1e6:.1f} MB, {counted(trials, 'trial')}")


def evaluation_of(command: Report, task: str) -> Evaluate:
    """Return the evaluation command of a report's trials."""
    return check(
        replace(
            Evaluate(command.source),
            trials=command.trials,
            quality=command.trials,
            objects=command.objects,
            perturb=command.perturb,
            motions=command.motions,
            seed=command.seed,
            threads=command.threads,
        ),
        task,
    )


def settings_of(found: assembly.Trained) -> dict[str, Any]:
    """Return the world's settings, with the names of the clip files without paths, as reports are
    passed on."""
    world = to_json(found.experiment.world)
    return world | {"motions": [Path(path).name for path in found.experiment.world.motions]}


def evaluations(folder: Path, run: RunDirectory | None) -> list[tuple[str, dict[str, Any]]]:
    """Return names and figures of the evaluations in a run or beside a published policy."""
    files = sorted(run.evaluations.glob("*.json") if run else folder.glob("evaluation*.json"))
    found = []
    for file in files:
        try:
            figures = json.loads(file.read_text())
            if {"success", "sustained", "by_object", "by_distance", "start_m"} <= set(figures):
                found.append((file.stem, figures))
        except (OSError, ValueError):
            continue
    return found


def headline(known: Sequence[dict[str, Any]], own: dict[str, Any]) -> dict[str, Any]:
    """Return the evaluation of the same checkpoint and protocol with the most trials."""
    same = [
        figures
        for figures in known
        if figures.get("iteration") == own["iteration"]
        and figures["perturbation"] == own["perturbation"]
        and figures["start_m"] == own["start_m"]
        and figures["objects"] == own["objects"]
    ]
    return max([own, *same], key=lambda figures: figures["trials"])


def order(outcomes: Outcomes, error_m: np.ndarray) -> list[int]:
    """Return the trials from best to worst: sustained before reached, by time; then by
    distance."""
    nearest = np.where(np.isfinite(error_m), error_m, np.inf).min(1)
    delay = np.where(outcomes.success, outcomes.time_s, 1e3 + nearest)
    rank = np.where(outcomes.sustained, 0, np.where(outcomes.success, 1, 2))
    fell = outcomes.fell.astype(int)
    return np.lexsort((delay, fell, rank)).tolist()


def shown(
    results: Results,
    protocol: Protocol,
    judge_style: StyleJudge | None,
    draws: bool,
    drawn: Callable[[], None] = lambda: None,
) -> list[page.Shown]:
    """Return the best, a median and the worst of the recorded trials; drawn: called after each."""
    outcomes = judge(results.error_m, results.fell_at, protocol)
    ranked = order(outcomes, results.error_m)
    picked = {"best": ranked[0], "median": ranked[len(ranked) // 2], "worst": ranked[-1]}
    found = []
    for name, trial in picked.items():
        track = results.tracks[trial]
        about = described(track, outcomes, trial)
        data = drawable(track) | {
            "about": about,
            "success_m": protocol.success_m,
            "fell": track.take.meta["fell_at_step"] is not None,
        }
        if judge_style is not None:
            rewards = style_rewards(judge_style, track)
            values = [round(float(x), 3) for x in rewards]
            # transitions before the first whole window are shown with its reward
            data["style"] = values[:1] * (judge_style.window - 2) + values
        strip = pictures.filmstrip(track) if draws else None
        found.append(page.Shown(name, about, data, strip))
        drawn()
    return found


def described(track: Track, outcomes: Outcomes, trial: int) -> str:
    """Return the outcome of a trial in one line."""
    if outcomes.sustained[trial]:
        result = f"target reached after {outcomes.time_s[trial]:.1f} s, and held"
    elif outcomes.success[trial]:
        result = f"target reached after {outcomes.time_s[trial]:.1f} s, but not held"
    else:
        result = f"never nearer than {100 * np.nanmin(track.error_m[: track.steps]):.0f} cm"
    if outcomes.fell[trial]:
        result += ", falls"
    distance = track.take.meta["distance_m"]
    return f"trial {trial}, {track.take.piece} from {distance:.1f} m: {result}"


def pieces_of(main: dict[str, Any], pieces: Sequence[Piece]) -> list[Piece]:
    """Return the pieces of an evaluation, each once."""
    wanted = {part["object"] for part in main["by_object"]}
    return [piece for name, piece in {p.name: p for p in pieces}.items() if name in wanted]


def pictures_of(pieces: Sequence[Piece], drawn: Callable[[], None]) -> dict[str, str]:
    """Return the pictures of pieces by name; drawn: called after each."""
    found = {}
    for piece in pieces:
        found[piece.name] = pictures.of_piece(piece)
        drawn()
    return found

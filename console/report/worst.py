"""`inhabit evaluate --worst N --out PAGE`: the worst trials of an evaluation in one page."""

from collections import Counter
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from console.commands import Evaluate
from console.evaluation import command as evaluation
from console.evaluation import trials
from console.evaluation.scores import Outcomes, Protocol, judge
from console.evaluation.stepping import BLOCK
from console.report import page
from console.report.command import described, order
from console.report.scene3d import drawable
from console.run import assembly, machine
from console.run.directory import write_text
from policy.checkpoints import lineage
from world import tasks
from world.furniture.piece import Piece

#: Every so many frames of a trial are in the page: at 15 Hz motion still reads well.
_EVERY = 2


def evaluate_command(command: Evaluate) -> int:
    """Run `inhabit evaluate`, and write the page of its worst trials if it is asked for."""
    if not command.worst or command.out is None:
        return evaluation.evaluate_command(command)
    out = command.out

    def then(
        found: assembly.Trained,
        pieces: Sequence[Piece],
        figures: dict[str, Any],
        results: trials.Results,
    ) -> None:
        text = worst_page(command, found, pieces, figures, results)
        write_text(out, text)
        shown = min(command.worst, command.trials)
        print(f"{out}: {len(text) / 1e6:.1f} MB, the worst {shown} of {command.trials} trials")

    return evaluation.evaluate_command(command, then)


def worst_page(
    command: Evaluate,
    found: assembly.Trained,
    pieces: Sequence[Piece],
    figures: dict[str, Any],
    results: trials.Results,
) -> str:
    """Return the HTML of the worst trials of an evaluation, the worst first.

    They are simulated once more, to be recorded: the numbers of a trial do not depend on the
    others, as long as whole blocks of inference are simulated.
    """
    task = tasks.make(found.task)
    protocol = Protocol(success_m=task.success_m, limit_s=task.evaluation.limit_s)
    outcomes = judge(results.error_m, results.fell_at, protocol)
    rows = order(outcomes, results.error_m)[::-1][: command.worst]
    world = found.experiment.world
    every = evaluation.manifest_of(found.task, pieces, command, protocol, world.scale)
    padded = [*rows, *[rows[0]] * (-len(rows) % BLOCK)]
    again = trials.run(
        world,
        found.weights,
        every.chosen(padded),
        protocol.steps,
        command.threads or machine.cores(),
        len(rows),
        simulator=command.simulator,
    )
    ends = judge(again.error_m, again.fell_at, protocol)
    shown = [
        drawable(track, _EVERY)
        | {
            "about": described(track, ends, i),
            "success_m": protocol.success_m,
            "fell": track.take.meta["fell_at_step"] is not None,
        }
        for i, track in enumerate(again.tracks)
    ]
    title = f"inhabit {found.task}: the worst {len(rows)} of {len(every)} trials"
    about = (
        f"{Path(found.path).name}, {found.manifest.samples / 1e6:.1f} M samples; seed"
        f" {command.seed}, {figures['objects']}, {every.target_m[0]:g}-{every.target_m[1]:g} m,"
        f" {command.perturb}. Success {page.percent(figures['success'])}, falls"
        f" {100 * figures['falls']:.1f} %. Licence: {lineage.licence(found.manifest.notes)}"
    )
    names = [str(track.take.meta["trial"]) for track in again.tracks]
    sections = (
        f"<h1>{escape(title)}</h1><p class='soft'>{escape(about)}</p>",
        page.player(names),
        f"<h2>Failures by class</h2>{failures(outcomes, every.pieces)}",
        f"<h2>These trials</h2>{page.table(_HEAD, [row(t) for t in again.tracks])}",
    )
    return page.document(title, sections, shown)


_HEAD = ("trial", "piece", "size", "from m", "fell after s", "stages reached", "nearest cm")


def row(track: trials.Track) -> tuple[str, ...]:
    """Return a trial as cells of the table."""
    meta, error = track.take.meta, track.error_m[: track.steps]
    fell = meta["fell_at_step"]
    nearest = error[np.isfinite(error)]
    return (
        str(meta["trial"]),
        track.take.piece,
        f"{track.take.scale:.2f}",
        f"{meta['distance_m']:.1f}",
        "-" if fell is None else f"{fell / 30:.1f}",
        ", ".join(meta["stages"]) or "none",
        f"{100 * float(nearest.min()):.0f}" if len(nearest) else "-",
    )


def failures(outcomes: Outcomes, pieces: Sequence[Piece]) -> str:
    """Return a table of all failures of an evaluation by class: falls, and others."""
    classes = np.array([piece.category for piece in pieces])
    fell = Counter(classes[~outcomes.success & outcomes.fell].tolist())
    stood = Counter(classes[~outcomes.success & ~outcomes.fell].tolist())
    rows = [
        (name, str(int((classes == name).sum())), str(fell[name]), str(stood[name]))
        for name in sorted(set(classes.tolist()))
    ]
    return page.table(("class", "trials", "fell", "did not arrive"), rows)

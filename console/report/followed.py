"""The report of a policy that follows clips: figures by clip, replays beside the reference."""

from collections.abc import Sequence
from html import escape
from typing import Any

import numpy as np

from console.commands import Report
from console.evaluation import tracking
from console.evaluation.command import followed
from console.evaluation.tables import number
from console.recording.format import Take, model_of
from console.report import page
from console.report.page import Figures
from console.report.scene3d import drawn, poses_of
from console.run import assembly
from policy.checkpoints import lineage
from world.character.model import CONTROL_HZ
from world.tasks.track import ROOT_M


def text(
    command: Report, found: assembly.Trained, metrics: Sequence[Figures], settings: Figures
) -> str:
    """Return the HTML of the report; metrics: of its training, settings: to show.

    Raises ConfigError for options that have no meaning here.
    """
    figures, takes = followed(command, found, min(command.trials, tracking.SLOTS))
    chosen = typical(takes)
    title = f"inhabit {found.task}: {found.path.name}"
    notes = found.manifest.notes
    own = tracking.notice(found, command.motions)
    about = (
        f"{found.manifest.samples / 1e6:.1f} M samples. Trained on: {lineage.data(notes)}."
        f" Licence: {lineage.licence(notes)}"
    )
    sections = (
        f"<h1>{escape(title)}</h1><p class='soft'>{escape(about)}</p>",
        f"<p class='soft'>{escape(own)}.</p>" if own else "",
        _headline(figures),
        "<h2>Best, median and worst trial</h2>",
        page.player(list(chosen), follows=True),
        f"<h2>By clip</h2>{by_clip(figures)}",
        page.curves(metrics),
        page.settings(settings),
    )
    return page.document(title, sections, [replay(takes[i]) for i in chosen.values()])


def typical(takes: Sequence[Take]) -> dict[str, int]:
    """Return the best, the median and the worst of some trials by the name of their button."""
    ranked = order(takes)
    return {"best": ranked[0], "median": ranked[len(ranked) // 2], "worst": ranked[-1]}


def order(takes: Sequence[Take]) -> list[int]:
    """Return the trials from best to worst: completed ones by their deviation, then the others,
    the longest first."""

    def rank(trial: int) -> tuple[bool, float]:
        meta = takes[trial].meta
        done = bool(meta["completed"])
        return not done, float(meta["body_cm"]) if done else -float(len(takes[trial]))

    return sorted(range(len(takes)), key=rank)


def described(take: Take) -> str:
    """Return the outcome of a trial in one line."""
    meta, seconds = take.meta, len(take) / CONTROL_HZ
    off = f"bodies {meta['body_cm']:.1f} cm off"
    if meta["completed"]:
        return f"{meta['clip']}: follows it to its end for {seconds:.1f} s, {off}"
    ends = ", ".join(name.removeprefix("end_") for name in meta["ends"])
    return f"{meta['clip']}: ends after {seconds:.1f} s by {ends}, {off}"


def replay(take: Take, every: int = 1) -> dict[str, Any]:
    """Return the data of the viewer of a trial, with its reference; every: control steps of a
    frame."""
    model = model_of(take)
    shown = slice(None, None, every)
    apart = np.linalg.norm(take.qpos[:, :2] - take.ghost[:, :2], axis=1)
    poses = poses_of(model, take)[shown]
    data = drawn(model, poses, apart[shown], len(poses), take.piece, take.ghost[shown])
    return data | {
        "hz": CONTROL_HZ / every,
        "about": described(take),
        "success_m": ROOT_M,
        "goal": "reference",
        "fell": False,
    }


def by_clip(figures: Figures) -> str:
    """Return the table of an evaluation by clip, all of them first."""
    head = ("clip", "trials", "completed (95 %)", "whole %", "body cm", "root cm", "object cm",
            "contact F1", "ends by")  # fmt: skip
    every: list[Figures] = [{"clip": "all"} | figures, *figures["by_clip"]]
    rows = []
    for row in every:
        ends = (
            f"{name.removeprefix('end_')} {100 * share:.0f} %"
            for name, share in row["ends"].items()
            if share
        )
        rows.append(
            (
                row["clip"],
                f"{row['trials']}",
                page.percent(row["completed"]) if row["trials"] else "-",
                number(row["completed_whole"]["rate"], 100, 0),
                number(row["body_cm"]),
                number(row["root_cm"]),
                number(row["object_cm"]),
                number(row["contact_f1"], 1, 3),
                ", ".join(ends),
            )
        )
    return page.table(head, rows)


def _headline(figures: Figures) -> str:
    low, high = figures["completed"]["ci95"]
    whole = figures["completed_whole"]
    cards = [
        (
            "completed",
            number(figures["completed"]["rate"], 100) + " %",
            f"{100 * low:.1f}-{100 * high:.1f}, from any frame",
        ),
        ("completed whole", number(whole["rate"], 100) + " %", "from the first frame"),
        ("bodies", number(figures["body_cm"]) + " cm", "from the reference's"),
    ]
    if figures["object_cm"] is not None:
        cards += [
            ("object", number(figures["object_cm"]) + " cm", "from the reference's"),
            ("contact F1", number(figures["contact_f1"], 1, 3), "both hands at the box"),
        ]
    return page.cards(cards)

"""`inhabit motions check`: how well clips, and motions still to be imported, fit the character."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.table import Table

from console.commands import MotionsCheck
from console.motions import child, measures
from console.motions.measures import ClipReport
from console.terminal import screen
from world.errors import ClipError
from world.motions import load
from world.motions.formats import landmarks, registry
from world.motions.formats.landmarks import Map
from world.refusals import refusing


def check_command(command: MotionsCheck) -> int:
    """Report on each clip; 1 if a file is unreadable or does not fit."""
    given = landmarks.read_map(command.map) if command.map else Map()
    reports = list(examined(command.paths, command.format, given))
    if command.json:
        print(json.dumps([asdict(report) for report in reports], indent=2))
    else:
        screen().print(table(reports))
        for report in reports:
            for text in remarks(report):
                print(f"{report.clip}: {text}")
        print(summary(reports))
    return 1 if any(report.refused for report in reports) else 0


def examined(
    paths: Sequence[Path], form: str | None = None, given: Map | None = None
) -> Iterator[ClipReport]:
    """A report on every clip; a file that cannot be read is reported, not raised.

    Clips of the character are measured as they are loaded, other formats as they are imported.
    """
    if not paths:
        yield from (measures.examine(clip) for clip in load.own_clips())
        return
    found = registry.find(list(paths), form)
    tasks = [child.task(path, (path, form, given)) for path in found]
    for path, result in zip(found, child.in_order(tasks, _examined), strict=True):
        if result.refused:
            yield measures.refusal(path.stem, result.refused)
        else:
            yield ClipReport(**result.value)


def _examined(path: Path, form: str | None, given: Map | None) -> dict[str, Any]:
    """In the process of a file: its report."""
    from world.motions.retarget.convert import retargeted

    with refusing(ClipError, path, "motion"):
        if (form or registry.detected(path)) == "clip":
            return asdict(measures.examine(load.read(path)))
        return asdict(measures.examine(retargeted(registry.read(path, form), given)))


def remarks(report: ClipReport) -> list[str]:
    """What a line of the table has no room for."""
    if report.refused:
        return [report.refused]
    found = []
    if report.discontinuities:
        found.append("breaks at " + ", ".join(f"{t:.2f} s" for t in report.discontinuities))
    if report.past_limits:
        found.append(
            f"{report.past_limits_joint} is past its range by up to {report.past_limits_deg:.0f}"
            f" degrees; some joint is in {100 * report.past_limits:.0f} % of the frames"
        )
    return found


def summary(reports: Sequence[ClipReport]) -> str:
    """All clips in a line: sums, and means over the time that they take."""
    read = [r for r in reports if not r.refused]
    seconds = sum(r.seconds for r in read)
    if not seconds:
        return f"{len(reports)} clips, none of use"

    def mean(field: str) -> float:
        return sum(getattr(r, field) * r.seconds for r in read) / seconds

    verdicts = ", ".join(
        f"{sum(r.verdict == v for r in reports)} {v}" for v in ("good", "fair", "poor", "refused")
    )
    return (
        f"{len(reports)} clips, {seconds:.0f} s: {verdicts}; hands and feet"
        f" {100 * mean('key_body_error_m'):.1f} cm off, feet slip"
        f" {100 * mean('foot_skate_before_m_s'):.1f} cm/s before and"
        f" {100 * mean('foot_skate_after_m_s'):.1f} after, deepest"
        f" {100 * max(r.penetration_m for r in read):.1f} cm below the floor"
    )


def table(reports: Sequence[ClipReport]) -> Table:
    """One line a clip."""
    shown = Table(
        "clip", "seconds", "off cm", "slip cm/s", "after", "sinks cm", "jerk m/s³", "after",
        "past limits", "breaks", "rests", "verdict",
    )  # fmt: skip
    for report in reports:
        shown.add_row(
            report.clip,
            f"{report.seconds:.1f}",
            f"{100 * report.key_body_error_m:.1f}",
            f"{100 * report.foot_skate_before_m_s:.1f}",
            f"{100 * report.foot_skate_after_m_s:.1f}",
            f"{100 * report.penetration_m:.1f}",
            f"{report.jerk_before_m_s3:.0f}",
            f"{report.jerk_after_m_s3:.0f}",
            f"{100 * report.past_limits:.0f} %",
            str(len(report.discontinuities)),
            str(len(report.rests)),
            report.verdict,
        )
    return shown

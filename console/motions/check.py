"""`inhabit motions check`: how well clips and importable motions fit the character."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.table import Table
from rich.text import Text

from console.commands import MotionsCheck
from console.motions import child, measures
from console.motions.importing import ClipSource, refusing_whole, stated
from console.motions.measures import ClipReport
from console.terminal import counted, screen
from world.motions import load
from world.motions.formats import registry
from world.motions.formats.landmarks import Map


def check_command(command: MotionsCheck) -> int:
    """Report on each clip; return 1 if any is refused."""
    given = stated(command)
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
    """Yield a report on every clip; an unreadable file gives a report too, not an error.

    Clips of the character are measured as loaded, other formats as imported.
    """
    if not paths:
        yield from (measures.examine(clip) for clip in load.own_clips())
        return
    found = registry.find(list(paths), form)
    named = {path.expanduser() for path in paths}
    tasks = [
        child.task(path, (ClipSource(path, path.stem, form, given or Map(), path in named),))
        for path in found
    ]
    for path, result in zip(found, child.in_order(tasks, _examined, "measuring"), strict=True):
        if result.refused:
            yield measures.refusal(path.stem, result.refused)
        elif result.value is not None:
            yield ClipReport(**result.value)


def _examined(source: ClipSource) -> dict[str, Any] | None:
    """Return the report of a file as JSON values, None for one without motion; runs in a child
    process."""
    with refusing_whole(source.path):
        if source.holds_none():
            return None
        if (source.form or registry.detected(source.path)) == "clip" and source.given == Map():
            return asdict(measures.examine(load.read(source.path), rate_stated=True))
        recording = source.recording()
        stated = source.rate_stated(recording)
        return asdict(measures.examine(source.clip(recording), recording.fps, stated))


def remarks(report: ClipReport) -> list[str]:
    """Return the details of a report that the table lacks."""
    if report.refused:
        return [report.refused]
    found = []
    if report.implausible:
        found.append(f"implausible: {report.implausible}")
    if report.discontinuities:
        found.append("breaks at " + ", ".join(f"{t:.2f} s" for t in report.discontinuities))
    if report.past_limits:
        found.append(
            f"{report.past_limits_joint} is past its range by up to {report.past_limits_deg:.0f}"
            f" degrees; some joint is in {100 * report.past_limits:.0f} % of the frames"
        )
    return found


def summary(reports: Sequence[ClipReport]) -> str:
    """Return one line on all clips: sums, and means weighted by their length."""
    read = [r for r in reports if not r.refused]
    seconds = sum(r.seconds for r in read)
    if not seconds:
        return f"{counted(len(reports), 'clip')}, none usable"

    def mean(field: str) -> float:
        return sum(getattr(r, field) * r.seconds for r in read) / seconds

    verdicts = ", ".join(
        f"{count} {verdict}"
        for verdict in ("good", "fair", "poor", "implausible", "refused")
        if (count := sum(r.verdict == verdict for r in reports)) or verdict != "implausible"
    )
    return (
        f"{counted(len(reports), 'clip')}, {seconds:.0f} s: {verdicts}; hands and feet"
        f" {100 * mean('key_body_error_m'):.1f} cm off, feet slip"
        f" {100 * mean('foot_skate_before_m_s'):.1f} cm/s before and"
        f" {100 * mean('foot_skate_after_m_s'):.1f} after, deepest"
        f" {100 * max(r.penetration_m for r in read):.1f} cm below the floor"
    )


def table(reports: Sequence[ClipReport]) -> Table:
    """Return a table with one row per clip."""
    shown = Table(
        "clip", "seconds", "off cm", "slip cm/s", "after", "sinks cm", "jerk m/s³", "after",
        "past limits", "breaks", "rests", "verdict",
    )  # fmt: skip
    for report in reports:
        shown.add_row(
            Text(report.clip),
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

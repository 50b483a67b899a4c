"""`inhabit motions list|check`: the clips there are, and how well they fit the character."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import Any

from rich.table import Table

from console import clip_check
from console.clip_check import ClipReport
from console.commands import MotionsCheck, MotionsList
from console.screen import screen
from world.errors import ClipError
from world.motions import load
from world.motions.clip import Clip


@lru_cache(maxsize=1)
def clips(paths: tuple[str, ...]) -> tuple[Clip, ...]:
    """The clips of paths as training has them, or the package's own."""
    return tuple(load.clips(paths))


def motions_command(command: MotionsList | MotionsCheck) -> int:
    """Print the table or JSON; `check` returns 1 if any file cannot be used."""
    if isinstance(command, MotionsCheck):
        return check(command.paths, command.json)
    rows = [listed(clip) for clip in clips(tuple(map(str, command.paths)))]
    if command.json:
        print(json.dumps(rows, indent=2))
        return 0
    table = Table("clip", "seconds", "seat", "seat height m", "licence")
    for row in rows:
        height = "" if row["seat_height_m"] is None else f"{row['seat_height_m']:.2f}"
        seat = "" if row["seat_from_s"] is None else f"{row['seat_from_s']}-{row['seat_to_s']} s"
        table.add_row(row["clip"], f"{row['seconds']:.1f}", seat, height, row["licence"][:48])
    screen().print(table)
    total = sum(row["seconds"] for row in rows)
    print(f"{len(rows)} clips, {total:.0f} s")
    return 0


def listed(clip: Clip) -> dict[str, Any]:
    """One clip's line in `motions list --json`."""
    seat = clip.seat
    return {
        "clip": clip.name,
        "frames": clip.frames,
        "seconds": round(clip.seconds, 3),
        "seat_from_s": round(seat.from_frame / clip.fps, 2) if seat else None,
        "seat_to_s": round(seat.to_frame / clip.fps, 2) if seat else None,
        "seat_height_m": round(seat.point_m[2], 3) if seat else None,
        "source": clip.source,
        "licence": clip.licence,
    }


def check(paths: Sequence[Path], as_json: bool) -> int:
    """Report on each clip; 1 if a file is unreadable, does not fit, or holds nothing of use."""
    reports = list(examined(paths))
    if as_json:
        print(json.dumps([asdict(report) for report in reports], indent=2))
    else:
        screen().print(table(reports))
        for report in reports:
            if report.refused:
                print(f"{report.clip}: {report.refused}")
    return 1 if any(report.refused for report in reports) else 0


def examined(paths: Sequence[Path]) -> list[ClipReport]:
    """A report on every clip; a file that cannot be read is reported, not raised."""
    if not paths:
        return [clip_check.examine(clip) for clip in load.own_clips()]
    reports = []
    for path in load.find([str(p) for p in paths]):
        try:
            reports.append(clip_check.examine(load.read(path)))
        except ClipError as error:
            reports.append(clip_check.refusal(path.stem, str(error)))
    return reports


def table(reports: Sequence[ClipReport]) -> Table:
    """One line a clip."""
    shown = Table(
        "clip", "seconds", "joints cm", "skate m/s", "mended", "sinks cm", "breaks", "rests",
        "verdict",
    )  # fmt: skip
    for report in reports:
        shown.add_row(
            report.clip,
            f"{report.seconds:.1f}",
            f"{100 * report.key_body_error_m:.1f}",
            f"{report.foot_skate_before_m_s:.2f}",
            f"{report.foot_skate_after_m_s:.2f}",
            f"{100 * report.penetration_m:.1f}",
            str(len(report.discontinuities)),
            str(len(report.rests)),
            report.verdict,
        )
    return shown

"""`inhabit motions`: dispatch of its commands, and the list of clips."""

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from rich.table import Table
from rich.text import Text

from console.commands import MotionsCheck, MotionsImport, MotionsList, MotionsPlay
from console.motions.reading import clips
from console.terminal import counted, doing, screen
from world.motions.clip import Clip

#: Characters of a licence in the table.
_LICENCE = 48


def motions_command(command: MotionsList | MotionsCheck | MotionsImport | MotionsPlay) -> int:
    """Run one of the commands of `motions`; return its exit code."""
    if isinstance(command, MotionsCheck):
        with doing("starting"):
            from console.motions.check import check_command

        return check_command(command)
    if isinstance(command, MotionsImport):
        with doing("starting"):
            from console.motions.importing import import_command

        return import_command(command)
    if isinstance(command, MotionsPlay):
        from console.motions.play import play_command

        return play_command(command)
    rows = [listed(clip) for clip in clips(tuple(map(str, command.paths)))]
    if command.json:
        print(json.dumps(rows, indent=2))
        return 0
    table = Table("clip", "seconds", "uses", "from-to s", "size m", "licence")
    for row in rows:
        span = "" if row["from_s"] is None else f"{row['from_s']}-{row['to_s']}"
        table.add_row(
            Text(row["clip"]),
            f"{row['seconds']:.1f}",
            row["uses"] or "",
            span,
            _size(row),
            Text(_short(row["licence"])),
        )
    screen().print(table)
    for line in terms(rows):
        print(line)
    total = sum(row["seconds"] for row in rows)
    print(f"{counted(len(rows), 'clip')}, {total:.0f} s: {_totals(rows)}")
    return 0


def terms(rows: Sequence[dict[str, Any]]) -> Iterator[str]:
    """Yield, whole, each licence that the table shows in part, with its number of clips."""
    for text, count in Counter(row["licence"] for row in rows).items():
        if _short(text) != text:
            yield f"licence of {counted(count, 'clip')}: {text}"


def _short(text: str) -> str:
    return text if len(text) <= _LICENCE else f"{text[: _LICENCE - 1]}…"


def listed(clip: Clip) -> dict[str, Any]:
    """Return the row of a clip in `motions list --json`."""
    seat, bed, box = clip.seat, clip.bed, clip.box
    span = None
    if box is not None and box.held.any():
        held = np.flatnonzero(box.held)
        span = int(held[0]), int(held[-1]) + 1
    elif seat is not None or bed is not None:
        rest = seat or bed
        assert rest is not None
        span = rest.from_frame, rest.to_frame
    return {
        "clip": clip.name,
        "frames": clip.frames,
        "seconds": round(clip.seconds, 3),
        "uses": "box" if box else "bed" if bed else "seat" if seat else None,
        "from_s": round(span[0] / clip.fps, 2) if span else None,
        "to_s": round(span[1] / clip.fps, 2) if span else None,
        "seat_from_s": round(seat.from_frame / clip.fps, 2) if seat else None,
        "seat_to_s": round(seat.to_frame / clip.fps, 2) if seat else None,
        "seat_height_m": round(seat.point_m[2], 3) if seat else None,
        "bed_height_m": round(bed.height_m, 3) if bed else None,
        "box_size_m": [round(edge, 3) for edge in box.size_m] if box else None,
        "source": clip.source,
        "licence": clip.licence,
    }


def _size(row: dict[str, Any]) -> str:
    """Return the height of a seat or bed, or the edges of a box, for the table."""
    if row["box_size_m"]:
        return " x ".join(f"{edge:.2f}" for edge in row["box_size_m"])
    height = row["seat_height_m"] if row["bed_height_m"] is None else row["bed_height_m"]
    return "" if height is None else f"{height:.2f}"


def _totals(rows: list[dict[str, Any]]) -> str:
    """Return the seconds of each category of clips."""
    kinds = {"seat": "sit", "bed": "lie", "box": "carry", None: "neither"}
    parts = []
    for kind, word in kinds.items():
        seconds = sum(row["seconds"] for row in rows if row["uses"] == kind)
        if seconds:
            parts.append(f"{word} {seconds:.0f} s")
    return ", ".join(parts)

"""`inhabit objects`: import meshes as furniture, list, check and show pieces."""

import itertools
import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from console.commands import Meshes, ObjectsCheck, ObjectsImport, ObjectsList, ObjectsShow
from console.objects import drop
from console.objects.rows import listed, outcome_row
from console.run import machine
from console.terminal import counted, doing, progress, screen
from world.errors import ChoiceError, ConfigError, PieceError
from world.furniture.catalogue import REGISTRY
from world.furniture.piece import Piece
from world.meshes import collection, importing, store
from world.meshes.build import ImportOptions
from world.meshes.frame import Frame
from world.meshes.importing import Job, Outcome

Command = ObjectsImport | ObjectsList | ObjectsCheck | ObjectsShow


def objects_command(command: Command) -> int:
    """Run one of the commands; return the exit code."""
    match command:
        case ObjectsList():
            pieces = collection.pieces(command.objects)
            report([listed(piece) for piece in pieces], command.json)
            return 0
        case ObjectsCheck():
            return check(command)
        case ObjectsImport():
            return import_pieces(command)
        case ObjectsShow():
            return show(command)


def check(command: ObjectsCheck) -> int:
    """Print the rows of pieces and meshes; return 1 if any is refused."""
    rows: list[dict[str, Any]] = []
    tested: list[Piece | None] = []
    for name in command.paths:
        path = Path(name)
        if name in collection.SPLITS or name.endswith(".json") or _has_pieces(path):
            pieces = collection.pieces([name])
            tested += pieces
            rows += [listed(piece) for piece in pieces]
        else:
            outcomes = imported(found([path], command.mesh), command.mesh)
            tested += [outcome.piece() for outcome in outcomes]
            rows += [outcome_row(outcome) for outcome in outcomes]
    if command.drop:
        _drop(rows, tested, command)
    report(rows, command.json)
    if command.drop and not command.json:
        drop.summarise(rows, screen())
    return int(any(row["refused"] for row in rows))


def _drop(rows: list[dict[str, Any]], found: list[Piece | None], command: ObjectsCheck) -> None:
    """Add the results of the drop test to each row."""
    pieces = [piece for piece in found if piece is not None]
    done = iter(drop.drops(pieces, command.drop, command.mesh.threads or machine.cores()))
    for row, piece in zip(rows, found, strict=True):
        row["drops"] = [] if piece is None else next(done)


def _has_pieces(path: Path) -> bool:
    return path.is_dir() and next(path.rglob(f"*{store.SUFFIX}"), None) is not None


def import_pieces(command: ObjectsImport) -> int:
    """Import, write one file per piece, report refusals; return 1 if any is refused."""
    work = found(command.paths, command.mesh)
    others = importing.replaced(work, command.out)
    if others and not command.replace:
        more = f" and {len(others) - 1} more" if len(others) > 1 else ""
        raise ConfigError(
            f"--out {command.out}: {others[0].name}{more} is no piece of this mesh; name another"
            " folder, or add --replace"
        )
    outcomes = imported(work, command.mesh)
    for outcome in outcomes:
        if outcome.document is not None:
            store.write(command.out / f"{outcome.name}{store.SUFFIX}", outcome.document)
    report([outcome_row(o) for o in outcomes], command.json)
    refused = sum(1 for o in outcomes if o.refused)
    if not command.json:
        cached = sum(o.cached for o in outcomes)
        screen().print(
            f"{counted(len(outcomes) - refused, 'piece')} in {command.out} "
            f"({cached} from the cache), {refused} refused"
        )
    return int(refused > 0)


def found(paths: Sequence[Path], mesh: Meshes) -> list[Job]:
    """Return the meshes of files and folders."""
    with doing("looking for meshes"):
        return importing.jobs(paths, options(mesh))


def imported(work: Sequence[Job], mesh: Meshes) -> list[Outcome]:
    """Return the outcomes of importing meshes, with a progress bar on a terminal."""
    done = itertools.count(1)
    with progress("pieces", len(work), "importing") as update:
        return importing.run(
            work, mesh.threads or machine.cores(), lambda outcome: update(next(done))
        )


def options(mesh: Meshes) -> ImportOptions:
    """Return the import options of the flags. Raises ConfigError, ChoiceError."""
    if mesh.unit is not None and mesh.height is not None:
        raise ConfigError("--unit and --height contradict each other: choose one")
    if mesh.height is not None and not 0.0 < mesh.height < 10.0:
        raise ConfigError(f"--height {mesh.height}: choose metres above 0 and below 10")
    if mesh.category is not None and mesh.category not in REGISTRY:
        raise ChoiceError("--category", mesh.category, list(REGISTRY))
    if mesh.up and mesh.front and mesh.up[1] == mesh.front[1]:
        raise ConfigError(f"--up {mesh.up} --front {mesh.front}: choose two different axes")
    frame = Frame(mesh.up, mesh.front, mesh.unit, mesh.height)
    return ImportOptions(
        frame,
        mesh.category,
        licence=mesh.licence,
        credit=mesh.credit,
        sit=seat_of(mesh.sit),
        force=mesh.force,
    )


def seat_of(text: str | None) -> tuple[float, float, float, float] | None:
    """Return X,Y,Z,YAW of --sit as numbers. Raises ConfigError."""
    if text is None:
        return None
    try:
        x, y, z, yaw = (float(part) for part in text.split(","))
    except ValueError:
        raise ConfigError(f"--sit {text}: give X,Y,Z,YAW in m and degrees") from None
    if not np.isfinite([x, y, z, yaw]).all() or z <= 0.0:
        raise ConfigError(f"--sit {text}: finite numbers, Z above 0")
    return x, y, z, yaw


def show(command: ObjectsShow) -> int:
    """Write the contact sheet, the page, or both."""
    from console.objects import page, sheet

    if command.sheet is None and command.html is None:
        raise ConfigError("objects show: give --sheet FILE.png, --html FILE.html or both")
    pieces = collection.pieces(command.objects)
    if command.category is not None:
        if command.category not in REGISTRY:
            raise ChoiceError("--category", command.category, list(REGISTRY))
        pieces = tuple(p for p in pieces if p.category == command.category)
    if not pieces:
        raise PieceError("no pieces of this category among those chosen")
    if command.limit > 0:
        # evenly over the selection, so that every category is shown
        at = np.linspace(0, len(pieces) - 1, min(command.limit, len(pieces))).round().astype(int)
        pieces = tuple(pieces[i] for i in at)
    if command.sheet is not None:
        sheet.write(command.sheet, pieces)
    if command.html is not None:
        page.write(command.html, pieces)
    for path in (command.sheet, command.html):
        if path is not None:
            screen().print(f"{counted(len(pieces), 'piece')} in {path}")
    return 0


def report(rows: list[dict[str, Any]], as_json: bool) -> None:
    """Print rows as JSON, or as a table followed by the refusals."""
    if as_json:
        print(json.dumps(rows, indent=2))
        return
    table = Table("piece", "class", "size m", "parts", "seat m", "lie", "mass kg", "licence")
    for row in rows:
        if row["refused"]:
            continue
        table.add_row(
            row["piece"],
            row["category"],
            " x ".join(f"{x:.2f}" for x in row["size_m"]),
            str(row["hulls"]),
            ", ".join(f"{place['height_m']:.2f}" for place in row["sit"]),
            "yes" if row["lie"] else "",
            f"{row['mass_kg']:.1f}",
            row["licence"],
        )
    output = screen()
    output.print(table)
    counts = Counter(row["category"] for row in rows if not row["refused"])
    output.print(", ".join(f"{count} {name}" for name, count in counts.items()))
    for row in rows:
        for place in row["sit"]:
            if place["slips_at"]:
                scales = ", ".join(f"{scale:g}" for scale in place["slips_at"])
                output.print(
                    f"{row['piece']}: a ragdoll does not stay seated at scale {scales}",
                    markup=False,
                )
        for note in row["notes"]:
            output.print(f"{row['piece']}: {note}", markup=False)
        if row["refused"]:
            output.print(f"refused: {row['refused']}", markup=False)

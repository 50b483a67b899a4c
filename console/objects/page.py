"""A page on which pieces of furniture can be turned, with their places: one file, no network."""

import contextlib
import json
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from console.objects.rows import listed
from world.errors import PieceError
from world.furniture.piece import Piece
from world.furniture.surface import polygons

_SLOT = "/*PIECES*/[]"


def page(pieces: Sequence[Piece]) -> str:
    """The page's HTML."""
    template = resources.files("console.objects").joinpath("page.html").read_text()
    # "</" would end the script
    data = json.dumps([shown(piece) for piece in pieces]).replace("</", "<\\/")
    return template.replace(_SLOT, data)


def shown(piece: Piece) -> dict[str, Any]:
    """What the page knows of a piece."""
    row = listed(piece)
    return {
        "name": piece.name,
        "category": piece.category,
        "size": row["size_m"],
        "mass_kg": row["mass_kg"],
        "sit": row["sit"],
        "lie": row["lie"],
        "licence": piece.licence,
        "credit": piece.credit,
        "faces": [[[round(float(x), 3) for x in p] for p in face] for face in polygons(piece)],
    }


def write(path: Path, pieces: Sequence[Piece]) -> None:
    """Write the page; it appears whole or not at all. Raises PieceError."""
    temporary = path.with_name(f".{path.name}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.write_text(page(pieces))
        temporary.replace(path)
    except OSError as error:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise PieceError(f"cannot write {path}: {error.strerror}") from error

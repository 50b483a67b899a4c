"""A self-contained page with 3-D views of pieces and their use points."""

import json
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from console.objects.rows import listed
from world.errors import PieceError
from world.furniture.piece import Piece
from world.furniture.surface import polygons
from world.partial_files import replacing

_SLOT = "/*PIECES*/[]"


def page(pieces: Sequence[Piece]) -> str:
    """Return the HTML of the page."""
    template = resources.files("console.objects").joinpath("page.html").read_text()
    # "</" ends a script element
    data = json.dumps([shown(piece) for piece in pieces]).replace("</", "<\\/")
    return template.replace(_SLOT, data)


def shown(piece: Piece) -> dict[str, Any]:
    """Return a piece as JSON values for the page."""
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
    """Write the page atomically. Raises PieceError."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as partial:
            partial.write_text(page(pieces), encoding="utf-8")
    except OSError as error:
        raise PieceError(f"cannot write {path}: {error.strerror}") from error

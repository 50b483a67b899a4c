"""`inhabit objects list`: the pieces of furniture that characters train and are tested on."""

import json
from typing import Any

import numpy as np
from rich.table import Table

from console.commands import ObjectsList
from console.screen import screen
from world.furniture.catalogue import catalogue
from world.furniture.piece import Piece


def objects_command(command: ObjectsList) -> int:
    """Print the table or JSON; returns the exit code."""
    pieces: list[Piece] = []
    if command.objects != "test":
        pieces += catalogue("train")
    if command.objects != "train":
        pieces += catalogue("test")
    rows = [listed(piece) for piece in pieces]
    if command.json:
        print(json.dumps(rows, indent=2))
        return 0
    table = Table("piece", "class", "size m", "boxes", "seat m", "mass kg")
    for row, piece in zip(rows, pieces, strict=True):
        table.add_row(
            row["piece"],
            row["category"],
            " x ".join(f"{x:.2f}" for x in row["size_m"]),
            str(row["hulls"]),
            ", ".join(f"{place['height_m']:.2f}" for place in row["sit"]),
            f"{piece.mass_kg:.1f}",
        )
    screen().print(table)
    return 0


def listed(piece: Piece) -> dict[str, Any]:
    """One piece's line, in the form that console.md gives `objects check --json`."""
    return {
        "piece": piece.name,
        "category": piece.category,
        "size_m": [round(x, 4) for x in piece.size_m],
        "hulls": len(piece.boxes),
        "sit": [
            {
                "point_m": [round(x, 4) for x in place.point_m],
                "height_m": round(place.point_m[2], 4),
                "facing_deg": round(float(np.rad2deg(place.facing_rad)), 2),
            }
            for place in piece.sit
        ],
        "lie": [],
        "refused": None,
    }

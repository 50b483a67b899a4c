"""Pieces and refused meshes as the rows of `objects list`, `import` and `check`."""

from typing import Any

import numpy as np

from world.furniture.piece import Piece
from world.meshes.importing import Outcome
from world.objects.drop_test import slips_at


def outcome_row(outcome: Outcome) -> dict[str, Any]:
    """Return the row of an imported or refused mesh."""
    piece = outcome.piece()
    if piece is not None:
        notes = (outcome.document or {}).get("notes", [])
        return listed(piece) | {"notes": [str(note) for note in notes]}
    return {
        "piece": outcome.name,
        "category": None,
        "size_m": None,
        "hulls": 0,
        "sit": [],
        "lie": [],
        "notes": [],
        "refused": outcome.refused,
    }


def listed(piece: Piece) -> dict[str, Any]:
    """Return the row of a piece in `objects check --json`."""
    lie = piece.lie
    return {
        "piece": piece.name,
        "category": piece.category,
        "size_m": [round(x, 4) for x in piece.size_m],
        "hulls": len(piece.boxes),
        "sit": [
            {
                "point_m": [round(x, 4) for x in place.point_m],
                "height_m": round(place.point_m[2] if place.seat_m is None else place.seat_m, 4),
                "facing_deg": round(float(np.rad2deg(place.facing_rad)), 2),
                "rests_at": place.rests_at,
                "slips_at": slips_at(place),
            }
            for place in piece.sit
        ],
        "lie": []
        if lie is None
        else [
            {
                "hip_m": [round(x, 4) for x in lie.hip_m],
                "head_m": [round(x, 4) for x in lie.head_m],
            }
        ],
        "mass_kg": round(piece.mass_kg, 2),
        "licence": piece.licence,
        "credit": piece.credit,
        "notes": [],
        "refused": None,
    }

"""Piece files: JSON with hulls, targets, mass and inertia, licence and credit."""

import json
import math
from pathlib import Path
from typing import Any

from world.errors import PieceError
from world.furniture.piece import Hull, Lying, Piece, SeatTarget, Vector
from world.meshes import decompose
from world.meshes.build import Built
from world.partial_files import replacing
from world.placeholders import read_bounded
from world.refusals import reason, refusing

FORMAT = "inhabit-piece"
VERSION = 1
SUFFIX = ".piece.json"
MAX_MASS_KG = 10_000.0
MAX_REACH_M = 100.0
MAX_DOCUMENT_BYTES = 1 << 26
"""Greatest coordinate."""


def document(built: Built, digest: str, file_name: str) -> dict[str, Any]:
    """The content of a piece file; digest: SHA-256 of the mesh."""
    piece = built.piece
    return {
        "format": FORMAT,
        "version": VERSION,
        "name": piece.name,
        "category": piece.category,
        "size_m": [round(x, 4) for x in piece.size_m],
        "mass_kg": round(piece.mass_kg, 3),
        "centre_of_mass_m": [round(float(x), 5) for x in built.centre_of_mass_m],
        "inertia_kg_m2": [[round(float(x), 6) for x in row] for row in built.inertia_kg_m2],
        "licence": piece.licence,
        "credit": piece.credit,
        "sit": [
            {
                "point_m": p.point_m,
                "facing_rad": p.facing_rad,
                "seat_m": p.seat_m,
                "rests_at": p.rests_at,
            }
            for p in piece.sit
        ],
        "lie": None
        if piece.lie is None
        else {"hip_m": piece.lie.hip_m, "head_m": piece.lie.head_m},
        "seat_error_m": built.seat_error_m,
        "notes": list(built.notes),
        "source": {"file": file_name, "sha256": digest},
        "hulls": [{"vertices_m": h.vertices_m, "faces": h.faces} for h in piece.hulls],
    }


def piece_of(document: Any, where: str) -> Piece:
    """The piece of a document. Raises PieceError, which names `where`."""
    with refusing(PieceError, Path(where), "piece"):
        return _piece_of(document, where)


def _piece_of(document: Any, where: str) -> Piece:
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise PieceError(f"{where}: not a piece of this program")
    if document.get("version") != VERSION:
        raise PieceError(f"{where}: version {document.get('version')}; this reads {VERSION}")
    try:
        hulls = tuple(
            Hull(
                tuple(_vector(v) for v in h["vertices_m"]),
                tuple((int(a), int(b), int(c)) for a, b, c in h["faces"]),
            )
            for h in document["hulls"]
        )
        for hull in hulls:
            if not all(0 <= i < len(hull.vertices_m) for face in hull.faces for i in face):
                raise ValueError("a face without its corner")
        lie = document["lie"]
        if not (0 < float(document["mass_kg"]) < MAX_MASS_KG):
            raise ValueError(f"a mass of {document['mass_kg']} kg")
        return Piece(
            str(document["name"]),
            str(document["category"]),
            tuple(decompose.around(hull) for hull in hulls),
            tuple(_place(p) for p in document["sit"]),
            float(document["mass_kg"]),
            licence=str(document["licence"]),
            lie=None if lie is None else Lying(_vector(lie["hip_m"]), _vector(lie["head_m"])),
            hulls=hulls,
            credit=str(document["credit"]),
        )
    except (AttributeError, KeyError, TypeError, ValueError, IndexError) as error:
        raise PieceError(f"{where}: damaged ({reason(error)})") from error


def write(path: Path, content: dict[str, Any]) -> None:
    """Write a document atomically. Raises PieceError."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as partial, partial.open("w") as file:
            json.dump(content, file)
    except OSError as error:
        raise PieceError(f"cannot write {path}: {error.strerror}") from error


def read_document(path: Path) -> dict[str, Any]:
    """The content of a piece file, not validated. Raises PieceError."""
    try:
        return json.loads(read_bounded(path, MAX_DOCUMENT_BYTES))
    except OSError as error:
        raise PieceError(f"cannot read {path}: {error.strerror}") from error
    except ValueError as error:
        raise PieceError(f"{path}: damaged ({reason(error)})") from error


def read(path: Path) -> Piece:
    """The piece of a file. Raises PieceError."""
    with refusing(PieceError, path, "piece"):
        return piece_of(read_document(path), str(path))


def files(path: Path) -> list[Path]:
    """The piece files of a folder, or the file itself. Raises PieceError where there is none."""
    if path.is_dir():
        found = sorted(path.rglob(f"*{SUFFIX}"))
        if not found:
            raise PieceError(f"{path}: no {SUFFIX} files; make some with inhabit objects import")
        return found
    if not path.exists():
        raise PieceError(f"no such file or folder: {path}")
    return [path]


def pieces(path: Path) -> tuple[Piece, ...]:
    """The pieces of a folder or file, by name. Raises PieceError."""
    return tuple(read(file) for file in files(path))


def _place(values: Any) -> SeatTarget:
    tested = values.get("rests_at")  # absent in older files
    rests_at = None if tested is None else tuple(float(scale) for scale in tested)
    seat = None if values.get("seat_m") is None else float(values["seat_m"])
    if seat is not None and not abs(seat) <= MAX_REACH_M:
        raise ValueError(f"a seat at {seat} m")
    return SeatTarget(_vector(values["point_m"]), float(values["facing_rad"]), seat, rests_at)


def _vector(values: Any) -> Vector:
    x, y, z = (float(v) for v in values)
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(z)):
        raise ValueError("a coordinate that is no number")
    if max(abs(x), abs(y), abs(z)) > MAX_REACH_M:
        raise ValueError(f"a coordinate beyond {MAX_REACH_M:g} m")
    return x, y, z

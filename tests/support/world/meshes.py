"""Meshes of catalogue pieces, as files and as libraries."""

import io
import zipfile
from pathlib import Path

import numpy as np
import trimesh

from world.furniture.catalogue import find
from world.furniture.piece import Piece
from world.furniture.surface import triangles
from world.meshes import decompose, store, sweethome
from world.meshes.build import Built, ImportOptions, located, places

CHAIR = find("chair-train-000")
TRIANGLES = triangles(CHAIR)


def mesh(corners: np.ndarray = TRIANGLES) -> trimesh.Trimesh:
    """The chair as trimesh has it, nothing merged: metres, z up, +x front."""
    return trimesh.Trimesh(
        corners.reshape(-1, 3), np.arange(corners.size // 3).reshape(-1, 3), process=False
    )


def written(folder: Path, suffix: str, corners: np.ndarray = TRIANGLES) -> Path:
    path = folder / f"chair{suffix}"
    path.write_bytes(_bytes(mesh(corners).export(file_type=suffix[1:])))
    return path


def _bytes(content: object) -> bytes:
    return content.encode() if isinstance(content, str) else bytes(content)  # pyright: ignore[reportArgumentType]


def y_up(corners: np.ndarray) -> np.ndarray:
    """From z up, +x front to y up, +z front."""
    return corners[..., [1, 2, 0]]


def library(entries: dict[str, bytes], catalogue: str | None = None) -> bytes:
    """A .sh3f."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        if catalogue is not None:
            archive.writestr(sweethome.CATALOGUE, catalogue)
        for name, content in entries.items():
            archive.writestr(name, content)
    return stream.getvalue()


CATALOGUE = """# a comment
provider=The library
license=CC0
id#1=a
name#1=Kitchen chair
category#1=Seats
model#1=/models/chair.obj
width#1=45
depth#1=50
height#1=90
modelRotation#1=1 0 0 0 1 0 0 0 1
creator#1=Ada \\
  Lovelace
name#2=Bar stool
model#2=/models/nothing.obj
width#2=40
depth#2=40
height#2=75
name#3=Lamp
model#3=/models/chair.obj
width#3=40
depth#3=40
height#3=75
name#4=Wrong table
model#4=/../../etc/table.obj
width#4=40
depth#4=40
height#4=75
name#5=Sofa
model#5=/models/chair.obj
width#5=wide
depth#5=40
height#5=75
"""


def built(sit: tuple[float, float, float, float] | None = None) -> Built:
    """The chair from its own boxes as hulls, cut by no decomposition."""
    parts = tuple(h for b in CHAIR.boxes if (h := decompose.closed(b.corners())) is not None)
    options = ImportOptions(category="chair", sit=sit)
    piece, error = located("mine", parts, options, places("mine", TRIANGLES, options))
    return Built(piece, np.zeros(3), np.eye(3), error)


def kept(folder: Path, piece: Piece) -> None:
    """The file of an imported piece: the given one's boxes as hulls, its places as found."""
    hulls = tuple(h for b in piece.boxes if (h := decompose.closed(b.corners())) is not None)
    own = built().piece
    own = Piece(
        piece.name, piece.category, piece.boxes, piece.sit, piece.mass_kg, own.seed, hulls=hulls
    )
    document = store.document(Built(own, np.zeros(3), np.eye(3), None), "0" * 64, "by-hand.obj")
    store.write(folder / f"{piece.name}{store.SUFFIX}", document)

"""Flags of `inhabit objects`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

Axis = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
Unit = Literal["m", "cm", "mm", "in", "ft"]


@dataclass(frozen=True)
class ObjectsList:
    """List pieces of furniture, one line each."""

    objects: tyro.conf.Positional[tuple[str, ...]] = ("all",)
    """train, test, all, or files and folders of imported pieces."""
    json: bool = False
    """Print JSON instead."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Meshes:
    """Frame, unit, category and terms of meshes; defaults by their format."""

    up: Axis | None = None
    """Axis of the file that points up; default: +y for glTF, else +z."""
    front: Axis | None = None
    """Axis of the file that a seated character faces; default: +z where y is up, else +x."""
    unit: Unit | None = None
    """Unit of the file's coordinates; default: m."""
    height: float | None = None
    """Height to scale the piece to, m, instead of a unit."""
    category: str | None = None
    """chair, armchair, low-stool, high-stool, sofa, bed or table; default: by the shape, and by the
    name of the folder or file among the classes that the shape allows."""
    licence: str = "unknown"
    """Licence of meshes whose files state none."""
    credit: str = ""
    """Author of meshes whose files state none."""
    sit: str | None = None
    """X,Y,Z,YAW (m, degrees; piece frame) of the seat, instead of detection."""
    force: bool = False
    """Import pieces off which their own drop test throws the ragdoll, too."""
    threads: int | None = None
    """Pieces processed in parallel; default: the number of cores."""


@dataclass(frozen=True)
class ObjectsImport:
    """Import meshes (OBJ, glTF, STL, PLY, Sweet Home 3D libraries) as pieces: hulls and use
    points."""

    paths: tyro.conf.Positional[tuple[Path, ...]]
    """Files or folders."""
    mesh: Annotated[Meshes, tyro.conf.arg(name="")]
    out: Path = Path("objects")
    """Folder of the pieces, one .piece.json each."""
    replace: bool = False
    """Replace pieces of other meshes that have the same names."""
    json: bool = False
    """Print JSON instead of a table, as objects check does."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class ObjectsCheck:
    """Check meshes or pieces as furniture: size, hulls, use points; exit code 1 if any is
    refused."""

    paths: tyro.conf.Positional[tuple[str, ...]]
    """Meshes, imported pieces, folders of either, or train, test, all."""
    mesh: Annotated[Meshes, tyro.conf.arg(name="")]
    drop: float = 0.0
    """Seconds of a drop test with a seated ragdoll on each piece, at scales 0.8, 1 and 1.2 (3 are
    enough to see whether it stays); 0: no test."""
    json: bool = False
    """Print JSON instead."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class ObjectsShow:
    """Show pieces with their use points: a contact sheet, or a page with 3-D views."""

    objects: tyro.conf.Positional[tuple[str, ...]] = ("test",)
    """train, test, all, or files and folders of imported pieces."""
    category: str | None = None
    """Category of the pieces to show; default: all."""
    limit: int = 60
    """Greatest number of pieces, spread evenly over the selection."""
    sheet: Path | None = None
    """Contact sheet to write (PNG)."""
    html: Path | None = None
    """Page to write, one self-contained file."""
    debug: bool = False
    """Show the traceback of an error."""

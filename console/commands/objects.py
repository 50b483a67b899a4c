"""The flags of `inhabit objects`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

Axis = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
Unit = Literal["m", "cm", "mm", "in", "ft"]


@dataclass(frozen=True)
class ObjectsList:
    """The pieces of furniture, a line each."""

    objects: tyro.conf.Positional[tuple[str, ...]] = ("all",)
    """train, test, all, or files and folders of imported pieces."""
    json: bool = False
    """Print JSON instead."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class Meshes:
    """How a mesh is to be understood; by default, as its format says."""

    up: Axis | None = None
    """The file's axis that points up; default: +y for glTF, else +z."""
    front: Axis | None = None
    """The file's axis that the user of the piece faces; default: +z where y is up, else +x."""
    unit: Unit | None = None
    """Of the file's coordinates; default: m."""
    height: float | None = None
    """Scale the piece to this height, m, instead of a unit."""
    category: str | None = None
    """chair, armchair, low-stool, high-stool, sofa, bed or table; default: by its folder's or
    file's name, else by its shape."""
    licence: str = "unknown"
    """Under which terms the meshes may be used, where they do not say so themselves."""
    credit: str = ""
    """Who made them, where they do not say so themselves."""
    sit: str | None = None
    """X,Y,Z,YAW (m, degrees; piece frame) of the place to sit, instead of looking for one."""
    threads: int | None = None
    """Pieces at a time; default: the cores there are."""


@dataclass(frozen=True)
class ObjectsImport:
    """Make pieces of meshes (OBJ, glTF, STL, PLY, Sweet Home 3D libraries): hulls and places."""

    paths: tyro.conf.Positional[tuple[Path, ...]]
    """Files or folders."""
    mesh: Annotated[Meshes, tyro.conf.arg(name="")]
    out: Path = Path("objects")
    """Folder for the pieces, a .piece.json each."""
    json: bool = False
    """Print JSON instead, as objects check does."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class ObjectsCheck:
    """What meshes or pieces are as furniture: size, hulls, places; 1 if any is refused."""

    paths: tyro.conf.Positional[tuple[str, ...]]
    """Meshes, imported pieces, folders of either, or train, test, all."""
    mesh: Annotated[Meshes, tyro.conf.arg(name="")]
    drop: float = 0.0
    """Also let a seated ragdoll down on each, at scale 0.8, 1 and 1.2, and watch it for so many
    seconds (3 tell whether it stays); 0: do not."""
    json: bool = False
    """Print JSON instead."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class ObjectsShow:
    """Pictures of pieces with their places: a contact sheet, or a page to turn them in."""

    objects: tyro.conf.Positional[tuple[str, ...]] = ("test",)
    """train, test, all, or files and folders of imported pieces."""
    category: str | None = None
    """Only this class."""
    limit: int = 60
    """At most so many pieces; 0: all."""
    sheet: Path | None = None
    """Write the contact sheet here (PNG)."""
    html: Path | None = None
    """Write the page here, one file that needs nothing else."""
    debug: bool = False
    """Show the traceback of an error."""

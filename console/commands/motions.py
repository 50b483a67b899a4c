"""Flags of `inhabit motions`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro


@dataclass(frozen=True)
class MotionsList:
    """List motion clips, one line each."""

    paths: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Files or folders; default: the package's own clips."""
    json: bool = False
    """Print JSON instead of a table."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class MotionsImport:
    """Import motions of other skeletons as clips of the character; exit code 1 if any is
    refused."""

    paths: Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="IN")]
    """Files or folders: BVH, ASF/AMC, DeepMimic .txt, AMASS .npz, SAMP and MimicKit .pkl, poselib
    .npy, OMOMO .pt, and clips (.npz) to repair."""
    out: Path
    """Folder of clips to write, for --motions."""
    map: Path | None = None
    """JSON with joint names ({"left_knee": "LeftLeg"}, or Parent/Name for one of several of equal
    name), and fps, unit_m and up as below."""
    fps: float | None = None
    """Frames per second of the files, in place of what they state."""
    unit: Literal["m", "cm", "mm", "in", "ft"] | None = None
    """Length unit of the files; of AMASS, SAMP and humanoid motions, that of the root's travel."""
    up: Literal["y", "z"] | None = None
    """Upward axis of the files."""
    format: str | None = None
    """Format of all files, instead of detection: bvh, acclaim, deepmimic, clip, amass, samp,
    mimickit, poselib or omomo."""
    replace: bool = False
    """Overwrite clips of the same name."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class MotionsCheck:
    """Measure how well clips fit the character: errors, skating, rests; exit code 1 if any is
    refused."""

    paths: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Files or folders, of clips or of motions to import; default: the package's own clips."""
    map: Path | None = None
    """As in motions import."""
    fps: float | None = None
    """As in motions import."""
    unit: Literal["m", "cm", "mm", "in", "ft"] | None = None
    """As in motions import."""
    up: Literal["y", "z"] | None = None
    """As in motions import."""
    format: str | None = None
    """As in motions import."""
    json: bool = False
    """Print JSON instead of a table."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class MotionsVary:
    """Make variants of clips that carry a box: other stands, other sizes, spliced of their own
    frames."""

    paths: Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="CLIPS")]
    """Files or folders of clips; those without a box have no variants."""
    out: Path
    """Folder of clips to write, for --motions: the given ones and their variants."""
    stand_m: tuple[float, ...] = (0.2, 0.35, 0.5, 0.65, 0.8)
    """Heights of the stands that the box is picked up from and put down on, m."""
    size: tuple[float, ...] = (0.85, 1.0, 1.25)
    """Sizes of the box, as multiples of the clip's."""
    replace: bool = False
    """Overwrite clips of the same name."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class MotionsPlay:
    """Play clips in a browser, with their objects and source skeletons."""

    paths: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Files or folders; default: the package's own clips."""
    only: str | None = None
    """Part of the name of the clips to play."""
    html: Path | None = None
    """Write the page to this file, which is self-contained, instead of serving it."""
    listen: str = "127.0.0.1:0"
    """HOST:PORT of the page; port 0 takes a free port and prints it."""
    open: bool = True
    """Open the browser."""
    debug: bool = False
    """Show the traceback of an error."""

"""The flags of `inhabit motions`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro


@dataclass(frozen=True)
class MotionsList:
    """The clips found, a line each."""

    paths: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Files or folders; default: the package's own."""
    json: bool = False
    """Print JSON instead."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class MotionsImport:
    """Motions of other bodies as clips of the character; 1 if any is refused."""

    paths: Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="IN")]
    """Files or folders: BVH, ASF/AMC, DeepMimic .txt, AMASS .npz, SAMP and MimicKit .pkl, poselib
    .npy, and clips (.npz) to be mended."""
    out: Path
    """The folder of clips to write, for --motions."""
    map: Path | None = None
    """JSON that names joints ({"left_knee": "LeftLeg"}), the length unit (unit_m), the upward axis
    (up: y or z) where files do not tell."""
    format: str | None = None
    """Read all files as this format instead of finding out: bvh, acclaim, deepmimic, clip, amass,
    samp, mimickit or poselib."""
    replace: bool = False
    """Write over clips of the same name."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class MotionsCheck:
    """How well clips fit the character: errors, skating, rests; 1 if any is refused."""

    paths: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Files or folders, of clips or of motions to import; default: the package's own."""
    map: Path | None = None
    """As of motions import."""
    format: str | None = None
    """As of motions import."""
    json: bool = False
    """Print JSON instead."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class MotionsPlay:
    """Clips in a browser, with what they use and the skeleton they came from."""

    paths: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Files or folders; default: the package's own."""
    only: str | None = None
    """Only clips whose name holds this."""
    html: Path | None = None
    """Write the page here, one file that needs nothing else, instead of serving it."""
    listen: str = "127.0.0.1:0"
    """HOST:PORT to serve it at; port 0 takes a free one and prints it."""
    open: bool = True
    """Open the browser."""
    debug: bool = False
    """Show the traceback of an error."""

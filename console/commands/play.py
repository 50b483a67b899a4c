"""Flags of `inhabit play`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro


@dataclass(frozen=True)
class Play:
    """Run a policy live in the browser and disturb it, or play a recording or clips."""

    sources: Annotated[
        tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUN|NAME|FILE")
    ]
    """Runs, checkpoint folders or names of policies that the package brings: sit, sit-free, lie,
    lie-free, carry, walk, track, track-sit (NAME=RUN sets the name, else the task is the name), or
    one file: a .msgpack recording or a motion clip."""
    checkpoint: Literal["best", "latest"] = "best"
    """Checkpoint of a run."""
    objects: str = "test"
    """Pieces to choose from: test (held out of training), train, or a file or folder of imported
    pieces."""
    motions: tuple[Path, ...] = ()
    """Clips in which the nearest mocap frame is searched; default: the policy's training clips."""
    listen: str = "127.0.0.1:0"
    """HOST:PORT of the page; port 0 takes a free port and prints it."""
    allow_insecure_remote: bool = False
    """Listen beyond this machine, without authentication."""
    open: bool = True
    """Open the browser."""
    debug: bool = False
    """Show the traceback of an error."""

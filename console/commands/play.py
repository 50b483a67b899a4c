"""The flags of the player."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro


@dataclass(frozen=True)
class Play:
    """A policy live in the browser, to be pushed and watched; or a recording, or clips."""

    sources: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUN|FILE")]
    """Runs or checkpoint folders to choose from (NAME=RUN gives a name, else its task is the name),
    or one file: a .msgpack recording or a motion clip."""
    checkpoint: Literal["best", "latest"] = "best"
    """Of a run: which."""
    objects: str = "test"
    """Pieces to choose from: test (never trained on), train, or a file or folder of imported
    ones."""
    motions: tuple[Path, ...] = ()
    """Clips that the nearest mocap is looked for in; default: those that the policy was trained
    on."""
    listen: str = "127.0.0.1:0"
    """HOST:PORT to serve the page at; port 0 takes a free one and prints it."""
    allow_insecure_remote: bool = False
    """Listen beyond this machine: whoever reaches the page can play."""
    open: bool = True
    """Open the browser."""
    debug: bool = False
    """Show the traceback of an error."""

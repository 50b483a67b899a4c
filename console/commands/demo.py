"""Flags of `inhabit demo`."""

from dataclasses import dataclass
from typing import Annotated

import tyro


@dataclass(frozen=True)
class Demo:
    """Send a character through a furnished room in the browser, with the package's policies."""

    policies: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUN")] = ()
    """Runs, checkpoint folders or names, each instead of the package's policy of its task."""
    seed: int = 0
    """Seed of the room, and of what the character chooses itself."""
    listen: str = "127.0.0.1:0"
    """HOST:PORT of the page; port 0 takes a free port and prints it."""
    allow_insecure_remote: bool = False
    """Listen beyond this machine, without authentication."""
    open: bool = True
    """Open the browser."""
    debug: bool = False
    """Show the traceback of an error."""

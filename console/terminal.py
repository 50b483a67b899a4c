"""Standard output for tables: as wide as the terminal, or a fixed width in a file."""

from typing import IO

from rich.console import Console

FILE_WIDTH = 150


def plain(file: IO[str] | None = None, width: int | None = None, record: bool = False) -> Console:
    """Return a rich console that takes text as it is: names of users may hold brackets and colons,
    which rich would read as markup and emoji."""
    return Console(file=file, width=width, record=record, markup=False, emoji=False)


def screen() -> Console:
    """Return such a console on standard output."""
    console = plain()
    return console if console.is_terminal else plain(width=FILE_WIDTH)

"""Standard output for tables: as wide as the terminal, or a fixed width in a file."""

from rich.console import Console

FILE_WIDTH = 150


def screen() -> Console:
    """Return a rich console on standard output."""
    console = Console()
    return console if console.is_terminal else Console(width=FILE_WIDTH)

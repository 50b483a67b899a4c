"""Where tables are printed: as wide as the terminal, and wide enough to be read in a file."""

from rich.console import Console

FILE_WIDTH = 150


def screen() -> Console:
    """Standard output."""
    console = Console()
    return console if console.is_terminal else Console(width=FILE_WIDTH)

"""The folders of a run's checkpoints, which their iterations name. Imports nothing that takes time:
commands list runs."""

from pathlib import Path


def name_of(iteration: int) -> str:
    """Name of the folder of an iteration's checkpoint: six digits or more."""
    return f"{iteration:06d}"


def numbered(directory: Path) -> list[Path]:
    """Folders of a run's checkpoints, oldest first; others, as a copy of one that someone set
    aside as 000100-good, are not a run's own."""
    found = [path for path in directory.glob("[0-9]*") if path.name.isdecimal() and path.is_dir()]
    return sorted(found, key=lambda path: int(path.name))

"""The licence and the data set of motion files, in words."""

from pathlib import Path

from world import terms

NOT_STATED = "not stated"


def licence(path: Path) -> str:
    """The licence of a motion file as its sources state it, whole, and whom it credits."""
    found = terms.of(path)
    if not found.licence:
        return NOT_STATED
    return f"{found.licence}, {found.credit}" if found.credit else found.licence


def dataset(path: Path) -> str:
    """The data set of a motion file that a catalogue names; else empty."""
    return terms.of(path).source


def named(file: str, data: str) -> str:
    """The source of a clip: its file, and the data set of that."""
    return f"{file} ({data})" if data else file

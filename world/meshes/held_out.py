"""Imported pieces that are held out of training, by name, for evaluation on unseen meshes.

The package has a list for the libraries that its results are measured on. A folder of pieces may
have its own, `held-out.txt`: a name a line, comments after #.
"""

from collections.abc import Iterable, Sequence
from functools import cache
from importlib import resources
from pathlib import Path

from world.errors import PieceError
from world.furniture.piece import Piece

FILE = "held-out.txt"


def names(path: Path) -> frozenset[str]:
    """The names that are held out of a folder of pieces, or of a piece's file: those of its list,
    else those of the package's. Raises PieceError for a list that cannot be read."""
    own = (path if path.is_dir() else path.parent) / FILE
    if not own.exists():
        return _package()
    try:
        return _parsed(own.read_text(encoding="utf-8").splitlines())
    except (OSError, UnicodeDecodeError) as error:
        raise PieceError(f"cannot read {own}: {error}") from error


@cache
def _package() -> frozenset[str]:
    text = resources.files("world.meshes").joinpath("data", FILE).read_text(encoding="utf-8")
    return _parsed(text.splitlines())


def _parsed(lines: Iterable[str]) -> frozenset[str]:
    found = (line.partition("#")[0].strip() for line in lines)
    return frozenset(name for name in found if name)


def kept(pieces: Sequence[Piece], path: Path) -> tuple[Piece, ...]:
    """The pieces of a path that training may use."""
    held = names(path)
    return tuple(piece for piece in pieces if piece.name not in held)


def held(pieces: Sequence[Piece], path: Path) -> tuple[Piece, ...]:
    """The pieces of a path that are held out. Raises PieceError without any."""
    listed = names(path)
    found = tuple(piece for piece in pieces if piece.name in listed)
    if not found:
        raise PieceError(
            f"{path}: none of {len(pieces)} pieces is held out of training: list some names in"
            f" {FILE} beside them"
        )
    return found

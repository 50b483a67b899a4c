"""Pieces by split of the catalogue, or from files of imported ones."""

from collections.abc import Sequence
from pathlib import Path

from world.errors import PieceError
from world.furniture import bands
from world.furniture.catalogue import whole
from world.furniture.piece import Piece
from world.furniture.usage import usage

#: Names of the catalogue's splits, and of both together.
SPLITS = (*bands.SPLITS, "all")


def pieces(names: Sequence[str], seed: int = 0) -> tuple[Piece, ...]:
    """The pieces of splits (`train`, `test`, `all`) and of piece files or folders of them.

    Raises PieceError for a path without pieces.
    """
    found: list[Piece] = []
    for name in names:
        if name in SPLITS:
            for split in ("train", "test"):
                if name in (split, "all"):
                    found += whole(split, seed)
        elif not Path(name).exists():
            raise PieceError(f"no furniture '{name}': choose {', '.join(SPLITS)} or a path")
        else:
            # imports scipy, which the pieces of the catalogue do not need
            from world.meshes import store

            found += store.pieces(Path(name))
    return tuple(found)


def usable(pieces: Sequence[Piece], affordance: str, where: str) -> tuple[Piece, ...]:
    """The pieces with the affordance. Raises PieceError, which names `where`, without one."""
    found = tuple(piece for piece in pieces if usage(affordance).use_points(piece))
    if not found:
        raise PieceError(f"{where}: none of {len(pieces)} pieces has a place to {affordance}")
    return found

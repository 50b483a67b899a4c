"""Pieces by split or path, and those of them that can be used."""

from pathlib import Path

import pytest

from world.errors import PieceError
from world.furniture.catalogue import find
from world.meshes.collection import pieces, usable


def test_splits_are_whole_and_paths_must_be_there(tmp_path: Path) -> None:
    test = pieces(["test"])
    assert len(test) == 60 and pieces(["all"]) == pieces(["train"]) + test
    with pytest.raises(PieceError, match="no furniture 'nowhere': choose train, test, all or a p"):
        pieces(["nowhere"])


def test_only_pieces_with_a_place_are_usable() -> None:
    chair, bed = find("chair-test-000"), find("bed-test-000")
    assert usable((chair, bed), "lie", "here") == (bed,)
    with pytest.raises(PieceError, match="here: none of 1 pieces has a place to lie"):
        usable((chair,), "lie", "here")

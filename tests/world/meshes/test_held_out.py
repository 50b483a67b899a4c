"""Imported pieces that are held out: by the package's list, or by a folder's own."""

import csv
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.paths import SHARED
from world.affordances import SEAT
from world.config import WorldConfig
from world.errors import PieceError
from world.furniture.catalogue import catalogue
from world.meshes import held_out
from world.meshes.importing import _tidy

PIECES = tuple(
    replace(piece, name=name)
    for piece, name in zip(
        catalogue("train", 4), ("a", "b", "scopia-bed1", "blendswap-cc-0-armchair2"), strict=True
    )
)


def test_a_third_of_each_class_of_the_libraries_is_held_out(tmp_path: Path) -> None:
    catalog = SHARED / "objects" / "catalog.csv"
    if not catalog.exists():
        pytest.skip("the shared furniture is not here")
    rows = list(csv.DictReader(catalog.open()))
    listed = held_out.names(tmp_path)
    classes = Counter(row["category"] for row in rows)
    held = Counter(row["category"] for row in rows if _tidy(row["file"]) in listed)
    assert sum(held.values()) == len(listed) == 32 and len(rows) == 94
    for name, count in classes.items():
        assert abs(held[name] - count / 3) < 1.0, name


def test_the_list_beside_the_pieces_comes_first(tmp_path: Path) -> None:
    assert [p.name for p in held_out.kept(PIECES, tmp_path)] == ["a", "b", "scopia-bed1"]
    assert [p.name for p in held_out.held(PIECES, tmp_path)] == ["blendswap-cc-0-armchair2"]
    (tmp_path / "held-out.txt").write_text("# mine\nb  # the second\n\nnot-there\n")
    assert [p.name for p in held_out.held(PIECES, tmp_path / "b.piece.json")] == ["b"]
    assert len(held_out.kept(PIECES, tmp_path)) == 3
    (tmp_path / "held-out.txt").write_text("")
    with pytest.raises(PieceError, match="none of 4 pieces is held out"):
        held_out.held(PIECES, tmp_path)
    (tmp_path / "held-out.txt").write_bytes(b"\xff\xfe")
    with pytest.raises(PieceError, match=r"cannot read .*held-out\.txt"):
        held_out.names(tmp_path)


def test_training_leaves_them_out_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("world.meshes.collection.pieces", lambda names: PIECES)
    world = WorldConfig(objects=(str(tmp_path),), held_out=False)
    pieces, line = SEAT.pieces(world)
    assert [piece.name for piece in pieces] == ["a", "b", "scopia-bed1"]
    assert line == "1 imported pieces are held out of training"
    assert len(SEAT.pieces(replace(world, held_out=True))[0]) == 4, "runs of earlier versions"

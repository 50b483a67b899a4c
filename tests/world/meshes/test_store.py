"""Pieces survive the file."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.support.world.meshes import built
from world.errors import PieceError
from world.meshes import store


def test_pieces_survive_the_file(tmp_path: Path) -> None:
    content = store.document(built(), "0" * 64, "chair.obj")
    path = tmp_path / f"mine{store.SUFFIX}"
    store.write(path, content)
    (back,) = store.pieces(tmp_path)
    again = store.read(path)
    assert back == again
    assert np.allclose(back.size_m, built().piece.size_m, atol=1e-6)
    assert not list(tmp_path.glob(".*"))
    for broken, says in (
        ("[]", "not a piece"),
        ("{", "damaged"),
        (json.dumps(content | {"version": 9}), "this reads 1"),
        (json.dumps({k: v for k, v in content.items() if k != "hulls"}), "damaged"),
        (json.dumps(content | {"sit": [{"point_m": [0, 0, float("nan")], "facing_rad": 0}]}),
         "damaged"),
    ):  # fmt: skip
        path.write_text(broken)
        with pytest.raises(PieceError, match=says):
            store.read(path)

"""Rows of pieces and refused meshes."""

from pathlib import Path

import numpy as np
import pytest

from console.objects.rows import listed, outcome_row
from world.furniture.catalogue import find
from world.meshes import importing
from world.meshes.build import ImportOptions


def test_a_row_has_the_sizes_and_seat_of_its_piece() -> None:
    piece = find("chair-test-000")
    row = listed(piece)
    low, high = piece.bounds()
    assert row["size_m"] == pytest.approx((high - low).tolist(), abs=1e-3)
    assert row["hulls"] == len(piece.boxes) and row["refused"] is None and row["lie"] == []
    (seat,) = row["sit"]
    assert seat["height_m"] == pytest.approx(piece.sit[0].point_m[2], abs=1e-4)
    assert seat["facing_deg"] == pytest.approx(float(np.rad2deg(piece.sit[0].facing_rad)), abs=0.01)


def test_a_refused_mesh_has_a_row_with_the_reason(tmp_path: Path) -> None:
    path = tmp_path / "broken.obj"
    path.write_text("nothing of the kind")
    (outcome,) = importing.run(importing.jobs([path], ImportOptions()), 1)
    row = outcome_row(outcome)
    assert row["hulls"] == 0 and row["sit"] == [] and row["refused"]
    assert set(row) <= set(listed(find("bed-test-000")))

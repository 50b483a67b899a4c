"""The furniture's bench steps what it says, and nothing blows up."""

import pytest

from console.bench import furniture
from world.furniture.catalogue import find


def test_a_mixture_beside_a_chair(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(furniture, "MEMORY_SCENES", 4)
    monkeypatch.setattr(furniture, "_EPISODE", 5)
    pieces = [find("chair-train-000"), find("bed-train-000"), find("table-train-000")]
    found = furniture.measure(pieces, scenes=3, seconds=0.0)
    assert found["pieces_count"] == 3 and found["broken_scenes_count"] == 0
    assert found["slots_count"] >= max(len(piece.boxes) for piece in pieces)
    ratio = found["chair_control_steps_per_s"] / found["mixed_control_steps_per_s"]
    assert found["mixed_to_chair_time_ratio"] == pytest.approx(ratio)

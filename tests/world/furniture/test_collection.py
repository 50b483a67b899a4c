"""Affordances choose the pieces."""

import pytest

from world.errors import ChoiceError, PieceError
from world.furniture.catalogue import AFFORDING, catalogue, find


def test_affordances_choose_classes() -> None:
    seats, places = (
        catalogue("train", 20, affordance="sit"),
        catalogue("test", 10, affordance="lie"),
    )
    assert {p.category for p in seats} == set(AFFORDING["sit"])
    assert all(p.sit for p in seats)
    assert [p.category for p in places[:4]] == ["sofa", "bed", "table", "sofa"]
    assert all(p.lie is not None for p in places)
    # the third table is not the third of its class, but the third that is long enough
    assert [p for p in places if p.category == "table"] == [
        p for i in range(61) if (p := find(f"table-test-{i:03d}")).lie is not None
    ][:3]
    with pytest.raises(PieceError, match="no table has a place to sit"):
        catalogue("train", 1, classes=("table",), affordance="sit")
    with pytest.raises(ChoiceError, match="choose one of lie, sit"):
        catalogue("train", 4, affordance="stand")  # pyright: ignore[reportArgumentType]

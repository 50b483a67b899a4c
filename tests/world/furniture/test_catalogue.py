"""The catalogue: balanced, the same every time, and train and test never meet."""

import dataclasses

import numpy as np
import pytest

from world.errors import ChoiceError, PieceError
from world.furniture import armchair, chair, stool
from world.furniture.bands import cells, draw
from world.furniture.catalogue import SEATS, catalogue, find
from world.furniture.usage import SIT

PIECES = catalogue("train") + catalogue("test")
GENERATORS = {
    "chair": (chair.dimensions, chair.RANGES),
    "armchair": (armchair.dimensions, armchair.RANGES),
    "low-stool": (stool.low_dimensions, stool.LOW),
    "high-stool": (stool.high_dimensions, stool.HIGH),
}


def test_catalogue_is_balanced_and_named():
    train, test = catalogue("train"), catalogue("test")
    assert (len(train), len(test)) == (60, 12)
    for name in SEATS:
        assert sum(p.category == name for p in train) == 15
        assert sum(p.category == name for p in test) == 3
    assert len({p.name for p in PIECES}) == 72
    assert train[4].name == "chair-train-001"


def test_catalogue_is_deterministic_and_extends():
    assert catalogue("train", 9) == catalogue("train")[:9]
    assert catalogue("train", 8, seed=1) != catalogue("train", 8)
    assert catalogue("test", 2, seed=3)[1] == find("armchair-test-000", seed=3)
    assert find("low-stool-train-007") == catalogue("train")[4 * 7 + 2]
    only = catalogue("train", 3, classes=("high-stool",))
    assert [p.name for p in only] == [f"high-stool-train-00{i}" for i in range(3)]


@pytest.mark.parametrize("name", ["throne-train-000", "chair-both-000"])
def test_unknown_class_or_split_names_the_choices(name: str):
    with pytest.raises(ChoiceError, match=r"low-stool|train"):
        find(name)


def test_a_malformed_name_is_refused_with_the_form_of_names():
    with pytest.raises(PieceError, match="chair-train-007"):
        find("chair")


def test_pieces_of_both_splits_differ_in_seat_height():
    for name in SEATS:
        heights = {
            split: [
                round(GENERATORS[name][0](np.random.default_rng(i), split).seat_height_m, 6)
                for i in range(200)
            ]
            for split in ("train", "test")
        }
        gap = min(abs(a - b) for a in heights["train"] for b in heights["test"])
        # A fifth of a cell lies between neighbouring cells: at least 0.2 * 0.02 m.
        assert gap >= 0.2 * 0.02 - 1e-6


@pytest.mark.parametrize("name", GENERATORS)
@pytest.mark.parametrize("split", ["train", "test"])
def test_every_drawn_dimension_stays_in_its_split(name: str, split):
    dimensions, ranges = GENERATORS[name]
    for seed in range(40):
        drawn = dataclasses.asdict(dimensions(np.random.default_rng(seed), split))
        for field, span in ranges.items():
            assert any(low <= drawn[field] <= high for low, high in cells(span, split)), field


def test_test_pieces_have_constructions_never_trained_on():
    assert not {b for b, _ in chair.STYLES["train"]} >= {b for b, _ in chair.STYLES["test"]}
    for styles in (armchair.STYLES, stool.LOW_BASES, stool.HIGH_BASES):
        assert set(styles["test"]) - set(styles["train"])


def test_a_few_pieces_show_every_construction():
    rng = np.random.default_rng(0)
    assert [chair.dimensions(rng, "test", i).base for i in range(6)] == [
        "legs",
        "cantilever",
        "cantilever",
        "panels",
        "sled",
        "legs",
    ]
    shown = {armchair.dimensions(rng, "test", i).style for i in range(3)}
    assert shown == {"open", "club", "swivel"}
    assert {stool.low_dimensions(rng, "train").base for _ in range(200)} == set(
        stool.LOW_BASES["train"]
    )


def test_draws_cover_every_cell():
    rng = np.random.default_rng(0)
    values = np.array([draw(rng, "train", {"a": (0.0, 5.0)})["a"] for _ in range(300)])
    assert set(values.astype(int)) == {0, 2, 4}


def test_affordances_choose_classes() -> None:
    seats, places = (
        catalogue("train", 20, affordance="sit"),
        catalogue("test", 10, affordance="lie"),
    )
    assert {p.category for p in seats} == set(SIT.classes)
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

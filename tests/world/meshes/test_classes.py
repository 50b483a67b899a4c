"""Classes by shape, and by name among those that the shape allows."""

import pytest

from world.furniture.affordance import lying, seats
from world.furniture.affordance.relief import relief
from world.furniture.catalogue import find
from world.furniture.surface import triangles
from world.meshes.classes import Shape, category_of, category_of_names, possible, shape_of


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("Scopia armchair", "armchair"),
        ("bar_stool", "high-stool"),
        ("coffee-table", "table"),
        ("comfortable chair", "chair"),  # no table
        ("desk_chair", "chair"),
        ("bedside chair", "chair"),
        ("ChairForDesk", "chair"),
        ("chair with table", "chair"),
        ("Stühle und chairs2", "chair"),
        ("stable", None),
        ("embedded benchmark", None),
        ("table lamp", None),
        ("lamp", None),
        ("foot stool 3", "low-stool"),
        ("sofaBed", "bed"),
        ("benches", "low-stool"),
    ],
)
def test_the_last_whole_word_of_a_name_counts(name: str, expected: str | None) -> None:
    assert category_of_names(name) == expected


def test_the_first_name_with_a_word_counts() -> None:
    assert category_of_names("thing", "sofa", "bed") == "sofa"


def shape(name: str) -> Shape:
    piece = find(name)
    surface = relief(triangles(piece))
    return shape_of(piece.size_m, surface, seats.find(surface), lying.find(surface))


@pytest.mark.parametrize(
    "name", ["chair", "armchair", "low-stool", "high-stool", "sofa", "bed", "table"]
)
@pytest.mark.parametrize("number", [0, 1])
def test_the_shape_of_each_class_allows_it(name: str, number: int) -> None:
    assert name in possible(shape(f"{name}-train-{number:03d}"))


def test_a_shape_overrules_a_name_that_it_does_not_allow() -> None:
    chair, table = shape("chair-train-000"), shape("table-train-000")
    category, said = category_of("table", chair)
    assert category == "chair"
    assert said.startswith("named a table, imported as a chair by its shape (a seat at 0.4")
    assert category_of("bed", chair)[0] == "chair"
    assert category_of("chair", table)[0] == "table"
    assert category_of("armchair", chair) == ("armchair", "")
    assert category_of(None, chair) == ("chair", "")


def test_stools_are_high_or_low_by_their_seat() -> None:
    assert category_of("stool", shape("high-stool-train-001"))[0] == "high-stool"
    assert category_of("stool", shape("low-stool-train-001"))[0] == "low-stool"


def test_what_neither_carries_nor_has_a_top_has_no_class() -> None:
    assert category_of("chair", Shape((0.3, 0.3, 1.8), None, False, False, 0.2, 0.05)) == (None, "")

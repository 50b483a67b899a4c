"""Classes by name and shape."""

from world.furniture.piece import SeatTarget
from world.meshes.classes import category_of, category_of_names


def test_classes_by_name_and_shape() -> None:
    assert category_of_names("Scopia armchair") == "armchair"
    assert category_of_names("bar_stool") == "high-stool"
    assert category_of_names("coffee-table") == "table"
    assert category_of_names("lamp") is None
    seat = (SeatTarget((0.0, 0.0, 0.7)),)
    assert category_of("stool", (0.4, 0.4, 0.7), seat, None) == "high-stool"
    assert category_of(None, (0.5, 0.45, 0.9), (SeatTarget((0.0, 0.0, 0.45)),), None) == "chair"
    assert category_of(None, (1.0, 1.5, 0.74), (), None) == "table"

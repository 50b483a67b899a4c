"""Classes by name and shape."""

from world.furniture.piece import Place
from world.meshes.classes import named, settled


def test_classes_by_name_and_shape() -> None:
    assert named("Scopia armchair") == "armchair"
    assert named("bar_stool") == "high-stool"
    assert named("coffee-table") == "table"
    assert named("lamp") is None
    seat = (Place((0.0, 0.0, 0.7)),)
    assert settled("stool", (0.4, 0.4, 0.7), seat, None) == "high-stool"
    assert settled(None, (0.5, 0.45, 0.9), (Place((0.0, 0.0, 0.45)),), None) == "chair"
    assert settled(None, (1.0, 1.5, 0.74), (), None) == "table"

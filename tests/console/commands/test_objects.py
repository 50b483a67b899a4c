"""The flags of `inhabit objects`, as they are typed."""

from pathlib import Path

import pytest

from console.app import parse
from console.commands import Meshes, ObjectsCheck, ObjectsImport, ObjectsList, ObjectsShow


def test_words_become_settings() -> None:
    assert parse(["objects", "list"]) == ObjectsList(("all",))
    found = parse(["objects", "import", "a.obj", "--up", "+y", "--unit", "cm", "--out", "o"])
    assert found == ObjectsImport((Path("a.obj"),), Meshes(up="+y", unit="cm"), Path("o"))
    found = parse(["objects", "check", "test", "--drop", "3"])
    assert isinstance(found, ObjectsCheck) and found.drop == 3.0
    found = parse(["objects", "show", "train", "--category", "sofa", "--limit", "9"])
    assert found == ObjectsShow(("train",), "sofa", 9)


@pytest.mark.parametrize("wrong", [("--up", "+w"), ("--unit", "km"), ("--height", "tall")])
def test_what_is_no_axis_unit_or_number_is_refused(wrong: tuple[str, str]) -> None:
    with pytest.raises(Exception, match=wrong[0]):
        parse(["objects", "import", "a.obj", *wrong])

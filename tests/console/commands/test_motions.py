"""The flags of `inhabit motions`, as they are typed."""

from pathlib import Path

import pytest

from console.app import parse
from console.commands import MotionsCheck, MotionsImport, MotionsList, MotionsPlay


def test_words_become_settings() -> None:
    assert parse(["motions", "list", "a", "b"]) == MotionsList((Path("a"), Path("b")))
    found = parse(["motions", "import", "in.bvh", "--out", "o", "--map", "m.json", "--replace"])
    assert found == MotionsImport((Path("in.bvh"),), Path("o"), Path("m.json"), replace=True)
    assert parse(["motions", "check", "--json"]) == MotionsCheck(json=True)
    found = parse(["motions", "play", "--only", "lie", "--no-open"])
    assert found == MotionsPlay(only="lie", open=False)


def test_an_import_needs_to_know_where_to(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(Exception, match="--out"):
        parse(["motions", "import", "in.bvh"])

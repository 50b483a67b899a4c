"""The command that drops a ragdoll on every seat."""

import json
from pathlib import Path

import pytest

from console.app import main
from world.furniture.catalogue import find


def test_the_command_drops(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from tests.support.world.meshes import kept

    kept(tmp_path, find("chair-train-003"))
    kept(tmp_path, find("table-train-000"))
    words = ["objects", "check", str(tmp_path), "--drop", "1", "--threads", "1"]
    assert main([*words, "--json"]) == 0
    rows = {row["piece"]: row["drops"] for row in json.loads(capsys.readouterr().out)}
    assert rows["table-train-000"] == []
    assert [one["scale"] for one in rows["chair-train-003"]] == [0.8, 1.0, 1.2]
    assert all(one["finite"] for one in rows["chair-train-003"])
    assert main(words) == 0
    assert "of 3 drops came to rest on the seat, 0 non-finite" in capsys.readouterr().out
    assert main(["objects", "check", str(tmp_path), "--drop", "-1"]) == 2

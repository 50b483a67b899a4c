"""The commands as their user meets them: exit codes, and what they list."""

import json
from pathlib import Path

import pytest

from console.app import main
from tests.support.console.runs import said


def test_bad_arguments_are_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["train", "fly"]) == 2
    assert "choose one of carry, lie, sit" in said(capsys)
    assert main(["train", "sit", "--resume", "--restart", "--run", str(tmp_path)]) == 2
    assert "contradict" in said(capsys)
    assert main(["train", "sit", "--scenes", "100"]) == 2
    assert "multiple" in said(capsys)
    assert main(["train", "sit", "--address", "127.0.0.1:1"]) == 2
    assert "--runner ray" in said(capsys)
    assert main(["train", "sit", "--resume"]) == 2
    assert "--run" in said(capsys)
    assert main(["train"]) == 2
    assert main(["frobnicate"]) == 2
    assert main(["video", str(tmp_path)]) == 2


def test_lists_and_checks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["objects", "list", "--json"]) == 0
    pieces = json.loads(capsys.readouterr().out)
    assert len(pieces) == 410 and {"piece", "category", "size_m", "sit"} <= set(pieces[0])
    (tmp_path / "broken.npz").write_bytes(b"nothing of the kind")
    assert main(["motions", "check", str(tmp_path), "--json"]) == 1
    report = json.loads(capsys.readouterr().out)[0]
    assert report["clip"] == "broken" and "not a readable" in report["refused"]

"""Published folders say what they are."""

import json
from pathlib import Path

import pytest

from console.app import main
from tests.support.paths import ROOT


def test_a_published_folder_describes_itself_and_acts(tmp_path: Path) -> None:
    """The committed policy, published again: nothing of this machine, and the same weights."""
    source = ROOT / "pretrained" / "sit"
    figures = tmp_path / "e.json"
    figures.write_text((source / "evaluation.json").read_text())
    disturbed = tmp_path / "p.json"
    disturbed.write_text(json.dumps(json.loads(figures.read_text()) | {"perturbation": "moved"}))
    out = tmp_path / "mine"
    words = ["publish", str(source), str(out), "--data", "clips", "--licence", "as you like"]
    assert main([*words, "--evaluation", str(figures), str(disturbed)]) == 0
    manifest = json.loads((out / "manifest.json").read_text())
    assert manifest["notes"]["data"] == "clips"
    assert manifest["notes"]["licence"] == "as you like"
    assert json.loads(manifest["notes"]["experiment"])["world"]["motions"] == []
    assert json.loads(manifest["notes"]["evaluation"])["perturbation"] == "none"
    assert json.loads((out / "evaluation.json").read_text())["checkpoint"] == "mine"
    assert json.loads((out / "evaluation-moved.json").read_text())["perturbation"] == "moved"
    assert (out / "policy.safetensors").read_bytes() == (source / "policy.safetensors").read_bytes()
    assert main([*words]) == 1  # it exists


def test_two_evaluations_of_a_kind_or_none_at_all_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = ROOT / "pretrained" / "sit"
    figures, broken = str(source / "evaluation.json"), tmp_path / "b.json"
    broken.write_text("[]")
    words = ["publish", str(source), str(tmp_path / "mine"), "--data", "clips", "--licence", "any"]
    assert main([*words, "--evaluation", figures, figures]) in (1, 2)
    assert "a second evaluation with perturbation none" in capsys.readouterr().err
    assert main([*words, "--evaluation", str(broken)]) in (1, 2)
    assert "is not an evaluation of `inhabit evaluate --json`" in capsys.readouterr().err
    assert not (tmp_path / "mine").exists()


def test_an_average_needs_the_checkpoints(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = ROOT / "pretrained" / "sit"
    words = ["publish", str(source), str(tmp_path / "mine"), "--data", "clips", "--licence", "any"]
    assert main([*words, "--average", "2"]) == 1
    assert "--average 2: only 1 up to" in capsys.readouterr().err
    assert main([*words, "--average", "0"]) in (1, 2)
    assert "--average 0: must be 1 to 1000" in capsys.readouterr().err
    assert not (tmp_path / "mine").exists()

"""The report: charts, poses and the page itself, which must need nothing but a browser."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from console.app import main
from console.evaluation.scores import Protocol, judge
from console.report.command import order
from tests.support.paths import ROOT


def test_trials_are_ranked_by_what_counts() -> None:
    protocol = Protocol(success_m=0.2, limit_s=1.0, hold_s=0.2, control_hz=10)
    error = np.ones((5, 12), np.float32)
    error[0, 3:] = 0.1  # sustained, late
    error[1, 1:] = 0.1  # sustained, soon
    error[2, 5] = 0.1  # touched
    error[3, 5] = 0.4  # near
    fell = np.array([12, 12, 12, 12, 3])
    assert order(judge(error, fell, protocol), error) == [1, 0, 2, 3, 4]


def test_a_report_is_one_file_that_needs_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def short(**fields: float) -> Protocol:
        return Protocol(**{**fields, "limit_s": 1.0, "hold_s": 0.2})

    for module in ("console.evaluation.command", "console.report.command"):
        monkeypatch.setattr(f"{module}.Protocol", short)
    monkeypatch.setattr("console.report.pictures.can_draw", lambda: False)
    monkeypatch.setattr("console.evaluation.command.assembly.library_of", lambda world: None)
    out = tmp_path / "report.html"
    policy = str(ROOT / "pretrained" / "sit")
    assert main(["report", policy, "--trials", "3", "--out", str(out), "--perturb", "moved"]) == 0
    text = out.read_text()
    assert len(text) < 5e6
    # nothing is fetched: no address, no file, no module
    assert not re.search(r"https?://|<link|\bsrc=\"(?!data:)|\bimport\b.*from|url\(", text)
    takes = re.search(r'id="takes">(.*?)</script>', text, re.S)
    assert takes is not None
    data = json.loads(takes[1])
    assert len(data) == 3 and all(one["frames"] >= 2 for one in data)
    for heading in ("By stage", "By distance", "By object", "Motion quality", "Training"):
        assert f"<h2>{heading}" in text
    assert "90.4" in text or "87.5" in text  # the paper's row
    assert str(tmp_path) not in text and "/work" not in text and str(Path.home()) not in text
    assert main(["report", policy, "--trials", "2"]) == 2
    assert "at least 3" in capsys.readouterr().err

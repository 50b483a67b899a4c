"""`inhabit realism` as its user meets it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from console.app import main
from console.run import assembly
from tests.support.console.runs import said
from tests.support.world.clips import saved
from world.motions import load
from world.motions.synthetic import library
from world.realism import phases, relative


def test_clips_against_clips(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    generator = np.random.default_rng(0)
    mocap = tmp_path / "given"
    mocap.mkdir()
    for i in range(4):
        saved(mocap / f"{i}.npz", library.curving(generator, 1.0, 1))
    clip = saved(tmp_path / "mine.npz", library.curving(generator, 1.0, -1))
    out = tmp_path / "out.json"
    words = ["realism", str(clip), "--against", str(mocap), "--folds", "1", "--json", str(out)]
    assert main(words) == 0
    shown = capsys.readouterr().out
    assert "mean jerk of the bodies" in shown
    assert "Reference: clips of given, 4 recordings, halved 1 times" in " ".join(shown.split())
    figures = json.loads(out.read_text())
    assert figures["reference"] == "clips of given"
    assert set(figures["phases"]) == set(phases.PHASES)
    values = figures["phases"]["all"]["values"]
    assert set(values) == set(relative.MEASURES)
    jerk = values["jerk"]
    assert jerk["ratio"] == pytest.approx(jerk["motion"] / jerk["mocap"])
    assert 0.5 < jerk["ratio"] < 2.0
    assert str(tmp_path) not in out.read_text()


def test_the_own_clips_of_the_package_are_not_called_mocap(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    own = [
        replace(library.walking(np.random.default_rng(i), 1.0).part(0, 90), name=f"walk {i}")
        for i in range(4)
    ]
    monkeypatch.setattr(load, "own_clips", lambda: own)
    clip = saved(tmp_path / "mine.npz", own[0])
    assert main(["realism", str(clip), "--task", "walk", "--folds", "1"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert f"Reference: {assembly.OWN_CLIPS}, 4 recordings, halved 1 times" in shown
    assert "mocap" not in shown.lower()


def test_wrong_sources_are_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["realism", str(tmp_path / "none.npz")]) == 2
    assert "none.npz: no such run, checkpoint folder or file" in said(capsys)
    clip = saved(tmp_path / "a.npz", library.walking(np.random.default_rng(0), 1.0))
    assert main(["realism", str(clip), "--against", str(clip)]) == 1
    assert "1 recordings to compare with: at least 4 are needed" in said(capsys)
    assert main(["realism", str(clip), "--task", "juggle"]) == 2
    assert "juggle" in said(capsys)

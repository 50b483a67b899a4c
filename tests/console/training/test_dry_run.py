"""A dry run shows everything and writes nothing."""

from pathlib import Path

import pytest

from console.app import main
from tests.support.console.runs import said


def test_dry_run_shows_everything_and_writes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    assert main(["train", "sit", "--dry-run", "--preset", "paper", "--run", str(run)]) == 0
    shown = capsys.readouterr().out
    for text in ("state: 114 numbers", "goal", "29 numbers", "overspeed", '"gamma": 0.99', "1024"):
        assert text in shown
    assert not run.exists()


def test_a_penalty_with_a_weight_is_a_term_of_the_reward(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["train", "sit", "--dry-run", "--world.penalty.jerk", "0.15"]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["│", "jerk", "│", "0.15", "│"] in rows
    assert not [row for row in rows if row[1:2] == ["skating"]]


@pytest.mark.parametrize(
    ("flag", "line"), [("--motions", "no clips found"), ("--objects", "no .piece.json files")]
)
def test_folders_without_data_are_refused_as_by_the_training(
    flag: str, line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["train", "sit", flag, str(tmp_path), "--run", str(tmp_path / "run")]
    assert main(words) == 1
    refused = said(capsys)
    assert line in refused and str(tmp_path) in refused
    assert main([*words, "--dry-run"]) == 1
    assert said(capsys) == refused

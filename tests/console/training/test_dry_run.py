"""A dry run shows everything and writes nothing."""

from pathlib import Path

import pytest

from console.app import main


def test_dry_run_shows_everything_and_writes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    assert main(["train", "sit", "--dry-run", "--preset", "paper", "--run", str(run)]) == 0
    shown = capsys.readouterr().out
    for text in ("state: 114 numbers", "goal", "29 numbers", "overspeed", '"gamma": 0.99', "1024"):
        assert text in shown
    assert not run.exists()

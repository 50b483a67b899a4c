"""A dry run shows everything and writes nothing."""

from pathlib import Path

import pytest

from console.app import main
from console.run import recipe
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


@pytest.mark.parametrize("task", ["sit", "lie", "carry", "walk"])
def test_the_schedule_of_a_recipe_is_shown_whole(
    task: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """In 100 columns: no setting, condition or limit is cut off."""
    assert main(["train", task, "--recipe", "paper", "--dry-run"]) == 0
    lines = capsys.readouterr().out.partition("\nschedule;")[2]
    lines = lines.partition(" M samples in all")[0].splitlines()[:-1]
    rows = [line for line in lines[1:] if line.startswith("│")]
    assert max(map(len, lines)) <= 100 and all(line.endswith("│") for line in rows)
    shown = " ".join("".join(lines).replace("│", " ").split())
    cells = [[cell.strip() for cell in row.strip("│").split("│")] for row in rows]
    for stage in recipe.find("paper", task).stages:
        assert f"{stage.limit / 1e6:g} M" in {row[3] for row in cells}
        for kind, rate in stage.success.items():
            assert f"{kind} >= {rate:.2f}" in {row[2].rstrip(",") for row in cells}
        for key in stage.settings:
            name = "task" if key == "world.task" else key.replace("_", "-")
            assert any(row[1].startswith(name) for row in cells), shown


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

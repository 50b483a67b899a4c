"""Presets are the published protocols."""

import json
from pathlib import Path

import pytest

from console.app import main
from console.evaluation.command import distances
from console.evaluation.presets import published
from tests.support.console.runs import said
from tests.support.console.trials import command
from world.errors import ChoiceError
from world.scene import perturbations


def test_presets_and_published_rows() -> None:
    assert distances(command(), "sit") == (1.0, 10.0)
    assert distances(command(preset="table3"), "sit") == (1.0, 5.0)
    assert distances(command(preset="table3", far_m=2.0), "sit") == (1.0, 2.0)
    assert [row.success for row in published("lie", "table1", "none")] == [90.2]
    assert [row.success for row in published("lie", "table1", "moved")] == [82.0]
    assert published("sit", "table3", "none")[0].time_s == 3.7
    assert distances(command(preset="weights"), "carry") == (1.0, 10.0)
    assert [row.success for row in published("carry", "weights", "none")] == [97.2]
    assert published("juggle", "table1", "none") == ()
    with pytest.raises(ChoiceError, match="moved, none, projectiles"):
        perturbations.draw("rain", 1, 0, 100)


def test_the_weights_protocol_is_of_carry_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["--preset", "weights", "--trials", "2", "--quality", "0"]
    assert main(["evaluate", "walk", *asked]) == 2
    assert "--preset weights: is of carry" in said(capsys)
    assert main(["evaluate", "carry", *asked, "--objects", "train"]) == 2
    assert "draws its own boxes" in said(capsys)
    figures = tmp_path / "weights.json"
    assert main(["evaluate", "carry", *asked, "--json", str(figures)]) == 0
    found = json.loads(figures.read_text())
    assert found["preset"] == "weights" and found["start_m"] == [1.0, 10.0]
    assert all(row["object"].endswith(" kg") for row in found["by_object"])
    assert "97.2" in capsys.readouterr().out, "the paper's row"

"""`inhabit plan` as a user types it."""

import json
from pathlib import Path

import pytest

from console.app import main


def test_a_plan_states_rates_memory_cost_and_the_limit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "plan.json"
    words = ["plan", "--actors", "8", "--scenes", "2048", "--network", "1024", "512"]
    assert main([*words, "--task", "carry", "--price", "0.05", "--json", str(out)]) == 0
    text = capsys.readouterr().out
    for word in ("samples/s", "limited by", "memory, learner", "core hours", "at the price given"):
        assert word in text
    found = json.loads(out.read_text())
    assert found["fleet"]["hidden"] == [1024, 512]
    bill = found["bill"]
    hours = 1e8 / found["estimate"]["samples_per_s"] / 3600
    assert bill["hours"] == pytest.approx(hours)
    assert bill["cost"] == pytest.approx(11 * hours * 0.05)  # 8 actors, learner 2, style 1


def test_costs_are_measured_here_when_asked(tmp_path: Path) -> None:
    out = tmp_path / "plan.json"
    assert main(["plan", "--measure", "--seconds", "0.3", "--json", str(out)]) == 0
    costs = json.loads(out.read_text())["costs"]
    assert costs["source"].startswith("this machine, sit")
    # between a fast and a slow machine
    assert 1e-5 < costs["world_s"] < 1e-2
    assert 1e-13 < costs["act_s"] < 1e-8
    assert 1e-13 < costs["update_s"] < 1e-8
    assert 0.0 < costs["score_s"] < 1e-2


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--actors 64 --scenes 100", "choose --scenes 4096"),
        ("--actors 0", "--actors 0"),
        ("--task swim", "swim"),
        ("--gbit-per-s nan", "--gbit-per-s"),
    ],
)
def test_what_cannot_be_planned(words: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", *words.split()]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert len(error.strip().splitlines()) == 1

"""`inhabit teach try`: the teacher in the trials of policies."""

import json
from typing import Any

import pytest

from console.app import main


def attempt(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, Any]:
    assert main(["teach", "try", *words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_the_teacher_reaches_boxes_near_by(capsys: pytest.CaptureFixture[str]) -> None:
    words = ("--trials", "4", "--near-m", "1.0", "--far-m", "1.5", "--seconds", "9")
    figures = attempt(capsys, *words)
    stages = {part["stage"]: part["rate"] for part in figures["by_stage"]}
    assert stages["approached"] == 1.0
    assert stages["grasped"] > 0.0
    assert len(figures["by_distance"]) and figures["success"]["rate"] <= stages["placed"]


def test_large_errors_make_it_fall(capsys: pytest.CaptureFixture[str]) -> None:
    words = ("--trials", "4", "--near-m", "3", "--far-m", "4", "--seconds", "4", "--noise", "0.3")
    assert attempt(capsys, *words)["falls"] == 1.0


def test_with_small_errors_it_reaches_the_box(capsys: pytest.CaptureFixture[str]) -> None:
    """The errors of students are larger: a gait that falls here cannot be taught."""
    words = ("--trials", "16", "--near-m", "2", "--far-m", "3", "--seconds", "7")
    figures = attempt(capsys, *words, "--noise", "0.03")
    stages = {part["stage"]: part["rate"] for part in figures["by_stage"]}
    assert stages["approached"] > 0.7

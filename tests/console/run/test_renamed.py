"""Experiments of earlier versions read as today's, and old flags are refused by name."""

import json
from pathlib import Path
from typing import Any

import pytest

from console.app import main
from console.run.experiment import Experiment, experiment_from_json, to_json
from console.run.metrics import read_metrics
from console.run.renamed import RENAMED, Converted, current, refuse_old_flags, taught_by
from tests.support.paths import ROOT
from world.errors import ConfigError

TABLE = {
    "world.starts.clip": "world.initial.reference",
    "world.starts.near": "world.initial.near",
    "world.pace": Converted("world.speed", lambda pace: 1 / pace),
    "world.carry.led": None,
    "overlap": "lag.overlap",
}


def recorded(task: str) -> dict[str, Any]:
    """The experiment that a committed policy's manifest records."""
    manifest = json.loads((ROOT / "pretrained" / task / "manifest.json").read_text())
    return json.loads(manifest["notes"]["experiment"])


def leaves(tree: Any, where: str = "") -> dict[str, Any]:
    """Each setting of an experiment's JSON by its dotted name."""
    if not isinstance(tree, dict):
        return {where: tree}
    found: dict[str, Any] = {}
    for name, value in tree.items():
        found |= leaves(value, f"{where}.{name}" if where else name)
    return found


def test_names_move_values_convert_and_the_removed_go() -> None:
    old = {
        "seed": 3,
        "overlap": True,
        "world": {
            "starts": {"clip": 0.1, "near": 0.2},
            "pace": 4.0,
            "carry": {"led": 1.0, "kept": 5},
        },
    }
    before = json.dumps(old)
    new = {
        "seed": 3,
        "lag": {"overlap": True},
        "world": {"initial": {"reference": 0.1, "near": 0.2}, "speed": 0.25, "carry": {"kept": 5}},
    }
    assert current(old, TABLE) == new
    assert json.dumps(old) == before
    assert current(new, TABLE) == new


def test_a_setting_under_both_names_is_refused() -> None:
    both = {"world": {"starts": {"near": 0.1}, "initial": {"near": 0.2}}}
    with pytest.raises(ConfigError, match=r"world\.starts\.near is today's world\.initial\.near"):
        current(both, TABLE)


@pytest.mark.parametrize("task", ["sit", "lie", "carry"])
def test_committed_policies_keep_every_surviving_value(task: str) -> None:
    old = recorded(task)
    new = leaves(to_json(experiment_from_json(old)))
    for name, value in leaves(old).items():
        entry = RENAMED.get(name, name)
        if isinstance(entry, Converted):
            assert new[entry.key] == entry.convert(value)
        elif entry is not None:
            assert new[entry] == value


def test_every_renamed_setting_leads_to_one_that_exists() -> None:
    today = leaves(to_json(Experiment()))
    for old, entry in RENAMED.items():
        assert old not in today
        if entry is not None:
            assert (entry.key if isinstance(entry, Converted) else entry) in today


def test_figures_of_earlier_runs_read_under_todays_names(tmp_path: Path) -> None:
    file, old = tmp_path / "metrics.jsonl", {"iteration": 1, "episode/success_clip": 0.25}
    file.write_text(json.dumps(old | {"episode/fall_near": 0.5}) + "\n")
    new = read_metrics(file)[0]
    assert new["episode/success_reference"] == 0.25 and new["episode/fall_near"] == 0.5
    assert len(new) == 3 and not any(name.endswith("_clip") for name in new)


def test_an_unknown_setting_is_one_clear_line() -> None:
    old = recorded("sit")
    old["world"]["gravity"] = 9.8
    with pytest.raises(ConfigError) as refused:
        experiment_from_json(old, "config.json")
    assert str(refused.value) == "config.json.world holds unknown settings: gravity"


@pytest.mark.parametrize(
    ("word", "line"),
    [
        ("--world.starts.near", "--world.starts.near is now --world.initial.near: use that"),
        ("--world.pace=2", "--world.pace is now --world.speed: use that"),
        ("--world.carry.led", "--world.carry.led no longer exists: leave it out"),
        ("--no-overlap", "--no-overlap is now --lag.overlap: use that"),
    ],
)
def test_old_flags_name_the_new(word: str, line: str) -> None:
    with pytest.raises(ConfigError) as refused:
        refuse_old_flags(["train", "sit", word, "1"], TABLE)
    assert str(refused.value) == line


def test_todays_flags_pass() -> None:
    refuse_old_flags(["train", "sit", "--seed", "3", "--world.initial.near", "1"], TABLE)


def test_the_command_line_refuses_old_flags(capsys: pytest.CaptureFixture[str]) -> None:
    for old in RENAMED:
        flag = "--" + old.replace("_", "-")
        assert main(["train", "sit", "--dry-run", flag, "1"]) == 2
        error = capsys.readouterr().err
        assert error.startswith(f"inhabit: {flag} ") and error.count("\n") == 1
    assert main(["serve", "run", "--max-situations", "9"]) == 2
    assert "--max-situations is now --max-poses" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("carry", "world", "gone"),
    [
        ({"porter": True, "lesson": False, "led": 0.0}, {}, "world.carry.porter"),
        ({"porter": False}, {}, None),
        ({}, {"teacher": "carry"}, "world.teacher"),
        ({}, {"teacher": None}, None),
        ({}, {}, None),
    ],
)
def test_policies_that_a_script_taught_are_still_read(
    carry: dict[str, Any], world: dict[str, Any], gone: str | None
) -> None:
    """The teacher is left out, and named, so that no training goes on without it unasked."""
    old = {"world": {"task": "carry", "carry": carry, **world}, "ppo": {"lesson_weight": 0.06}}
    assert taught_by(old) == gone
    found = experiment_from_json(old)
    assert found.ppo.imitation_weight == 0.06
    assert not {"teacher", "porter"} & set(leaves(to_json(found.world)))

"""Experiments as JSON and back, their differences, and settings that contradict one another."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from console.run.directory import RunDirectory, RunError
from console.run.experiment import (
    PRESETS,
    Experiment,
    check,
    differences,
    from_json,
    read_experiment,
    to_json,
    with_learner_threads,
)
from learner.config import LagConfig
from world.config import CarryConfig, WorldConfig
from world.errors import ConfigError


@pytest.mark.parametrize("preset", list(PRESETS))
def test_json_and_back(preset: str) -> None:
    wanted = replace(
        PRESETS[preset],
        world=replace(PRESETS[preset].world, motions=("a", "b"), episode_s=7.0,
                      carry=CarryConfig(weight_kg=(1, 12))),
    )  # fmt: skip
    assert from_json(Experiment, json.loads(json.dumps(to_json(wanted)))) == wanted


def test_a_missing_setting_keeps_its_default_and_an_unknown_one_is_refused() -> None:
    assert from_json(Experiment, {"scenes": 64}) == Experiment(scenes=64)
    with pytest.raises(ConfigError, match=r"config\.world holds unknown settings: flying"):
        from_json(Experiment, {"world": {"flying": True}})


def test_differences_are_named() -> None:
    changed = replace(Experiment(), seed=3, world=WorldConfig(task="lie"))
    found = list(differences(to_json(Experiment()), to_json(changed)))
    assert found == ["seed: 0 -> 3", "world.task: sit -> lie"]
    assert list(differences({"a": 1}, {"a": 1, "b": 2}, "x")) == ["x.b: None -> 2"]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"scenes": 0}, "must be above 0"),
        ({"scenes": 100}, r"--scenes 100 is not a multiple of --block 64: choose 128"),
        ({"lag": LagConfig(max_style=-1)}, "must be 0 or above"),
        ({"lag": LagConfig(overlap=True, max_policy=0)}, "leave one of them out"),
    ],
)
def test_contradictions_are_refused(changes: dict, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        check(replace(Experiment(), **changes))


def test_threads_are_no_part_of_the_numbers() -> None:
    assert with_learner_threads(Experiment(), 1).ppo.threads == 1
    assert with_learner_threads(Experiment(), 9).ppo.threads == 2


def test_a_damaged_configuration_is_one_line(tmp_path: Path) -> None:
    run = RunDirectory(tmp_path)
    (tmp_path / "config.json").write_text('{"experiment": 5}')
    with pytest.raises(RunError, match="is not a run's configuration"):
        read_experiment(run)

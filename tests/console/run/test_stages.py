"""Stages as JSON: what config.json and checkpoints record."""

from dataclasses import replace

from console.run.experiment import PRESETS, experiment_from_json, to_json
from console.run.stages import Stage


def test_stages_come_back_from_json_as_they_were() -> None:
    settings = {"ppo.sigma": [[0, 0.05], [6e6, 0.035]], "world.walker": "walk", "ppo.skip": True}
    stage = Stage("a", "b", settings, {"near": 0.4, "all": 0.1}, 100, 5, 1000)
    experiment = replace(PRESETS["fast"], stages=(stage, Stage("c")))
    assert experiment_from_json(to_json(experiment)) == experiment

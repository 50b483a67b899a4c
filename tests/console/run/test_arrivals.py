"""From where a tracker takes boxes up: where the shipped walker comes to them."""

import pickle
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from console.run import arrivals, assembly
from console.run.directory import RunDirectory
from console.run.experiment import PRESETS, Experiment
from tests.support.paths import ROOT
from world import rotations
from world.config import TrackConfig, WorldConfig
from world.errors import ConfigError

WALKER = str(ROOT / "pretrained" / "walk")


def experiment(task: str = "track", walker: str = WALKER) -> Experiment:
    world = WorldConfig(task=task, episode_s=6.0, track=TrackConfig(walker=walker))
    return replace(PRESETS["fast"], seed=3, world=world)


def test_the_walker_comes_to_the_boxes_and_looks_at_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arrivals, "_SCENES", 32)
    monkeypatch.setattr(arrivals, "_STEPS", 150)
    found = arrivals.arrivals_of(experiment(), assembly.trained)
    assert found is not None and len(found.qpos) >= 20
    assert found.qpos.shape == (len(found.qvel), 43) and found.qvel.shape[1] == 34
    before, aside = found.qpos[:, 0], found.qpos[:, 1].abs()
    assert float(before.min()) > -0.45 and float(before.max()) < -0.05
    assert float(aside.max()) < 0.25
    assert float(found.qpos[:, 2].min()) > 0.7
    yaw = rotations.yaw(rotations.heading(found.qpos[:, 3:7])).abs()
    assert 0.05 < float(yaw.median()) < 0.7
    again = arrivals.arrivals_of(experiment(), assembly.trained)
    assert again is not None and torch.equal(found.qpos, again.qpos)


def test_without_a_walker_there_are_none() -> None:
    assert arrivals.arrivals_of(experiment(walker=""), assembly.trained) is None


def test_what_is_no_walker_of_these_actions_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"no scene here has the task track: leave it out"):
        arrivals.walker_of(experiment("sit"), assembly.trained)
    seated = str(ROOT / "pretrained" / "sit-free")
    with pytest.raises(ConfigError, match=r"of the task sit: name a run or checkpoint of the task"):
        arrivals.walker_of(experiment(walker=seated), assembly.trained)
    other = experiment()
    other = replace(other, world=replace(other.world, action_scale=0.123))
    with pytest.raises(ConfigError, match=r"--world\.action-scale .* give the same"):
        arrivals.walker_of(other, assembly.trained)
    assert arrivals.walker_of(experiment(), assembly.trained) is not None


def test_every_shard_of_a_training_has_the_same_arrivals(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(arrivals, "_SCENES", 16)
    monkeypatch.setattr(arrivals, "_STEPS", 120)
    make = assembly.make_shard(experiment(), RunDirectory(tmp_path))
    assert make.arrivals is not None and len(make.arrivals.qpos) > 4
    sent = pickle.loads(pickle.dumps(make))
    assert sent.arrivals is not None
    assert torch.equal(sent.arrivals.qpos, make.arrivals.qpos)
    shard = sent(range(4))
    state, _ = shard.observe()
    assert bool(shard.step(torch.zeros(4, 28)).finite.all()) and state.shape[0] == 4

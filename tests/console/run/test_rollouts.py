"""In which states tracking begins: those from which the shipped tracker went on."""

import pickle
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from console.run import assembly, rollouts
from console.run.directory import RunDirectory
from console.run.experiment import PRESETS, Experiment
from tests.support.paths import ROOT
from tests.support.track_scenes import clips
from world.config import TrackConfig, WorldConfig
from world.errors import ConfigError
from world.motions import clip_file

TRACKER = str(ROOT / "pretrained" / "track")


def experiment(folder: Path, task: str = "track", tracker: str = TRACKER) -> Experiment:
    for clip in clips()[::2]:
        clip_file.write(folder / f"{clip.name}.npz", clip)
    track = TrackConfig(rollouts=tracker, boxes=2)
    world = WorldConfig(task=task, episode_s=6.0, track=track, motions=(str(folder),))
    return replace(PRESETS["fast"], seed=3, world=world)


def test_every_shard_of_a_training_has_the_same_states(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(rollouts, "_SCENES", 16)
    monkeypatch.setattr(rollouts, "_STEPS", 80)
    make = assembly.make_shard(experiment(tmp_path), RunDirectory(tmp_path / "run"))
    assert make.rollouts is not None and len(make.rollouts.key) > 40
    assert bool(make.rollouts.qpos.isfinite().all()) and bool((make.rollouts.qpos[:, 2] > 0).all())
    again = assembly.make_shard(experiment(tmp_path), RunDirectory(tmp_path / "run"))
    assert again.rollouts is not None and torch.equal(again.rollouts.qpos, make.rollouts.qpos)
    sent = pickle.loads(pickle.dumps(make))
    assert torch.equal(sent.rollouts.key, make.rollouts.key)
    shard = sent(range(8))
    assert bool(shard.step(torch.zeros(8, 28)).finite.all())


def test_without_a_tracker_there_are_none(tmp_path: Path) -> None:
    none = experiment(tmp_path, tracker="")
    assert rollouts.rollouts_of(none, assembly.trained, assembly.training_bank) is None


def test_what_is_no_tracker_of_these_actions_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"no scene here has the task track: leave it out"):
        rollouts.tracker_of(experiment(tmp_path, "sit"), assembly.trained)
    walk = str(ROOT / "pretrained" / "walk")
    with pytest.raises(ConfigError, match=r"--world\.track\.rollouts .* of the task walk: name"):
        rollouts.tracker_of(experiment(tmp_path, tracker=walk), assembly.trained)
    other = experiment(tmp_path)
    other = replace(other, world=replace(other.world, action_scale=0.123))
    with pytest.raises(ConfigError, match=r"--world\.action-scale .* give the same"):
        rollouts.tracker_of(other, assembly.trained)

"""The discriminator of a checkpoint judges as it did when it was trained."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from console.evaluation.style_judge import StyleJudge, judge_of
from console.run import assembly
from console.run.experiment import PRESETS, Experiment, to_json
from discriminator import loss, normaliser
from discriminator.config import StyleConfig
from discriminator.network import StyleNetwork
from policy.checkpoints.format import Manifest, read_manifest, write
from policy.errors import CheckpointError
from tests.support.paths import ROOT


def checkpoint(folder: Path, experiment: Experiment, width: int) -> tuple[Path, StyleNetwork]:
    """A checkpoint whose style is a network with random weights, and that network."""
    network = StyleNetwork(2 * width, experiment.style.hidden, torch.Generator().manual_seed(4))
    with torch.no_grad():
        network.linears[-1].weight.mul_(30.0)
    style = {f"network/{k}": v for k, v in network.state_dict().items()}
    style |= {"normaliser/mean": torch.ones(114), "normaliser/deviation": torch.full((114,), 2.0)}
    notes = {"experiment": json.dumps(to_json(experiment))}
    manifest = Manifest(assembly.layout(experiment), 1, 1, notes)
    return write(folder / "000001", {"policy": {}, "style": style}, manifest), network


@pytest.mark.parametrize("object_features", [True, False])
def test_rewards_are_the_networks(tmp_path: Path, object_features: bool) -> None:
    style = StyleConfig(hidden=(16, 8), object_features=object_features)
    experiment = replace(PRESETS["fast"], style=style)
    kept = torch.arange(114) if object_features else (~assembly.object_mask()).nonzero().flatten()
    path, network = checkpoint(tmp_path, experiment, len(kept))
    judge = StyleJudge(path, experiment)
    before, after = torch.randn(2, 50, 114, generator=torch.Generator().manual_seed(1))
    rows = [normaliser.normalise(s, torch.tensor(1.0), torch.tensor(2.0)) for s in (before, after)]
    with torch.no_grad():
        logits = network(torch.cat([row[:, kept] for row in rows], 1))
    wanted = loss.style_reward(logits, style.clamp, style.reward_scale)
    torch.testing.assert_close(judge.reward(before, after), wanted)
    assert wanted.std() > 0.01


def test_a_published_policy_has_no_judge(tmp_path: Path) -> None:
    experiment = replace(PRESETS["fast"], style=StyleConfig(hidden=(16, 8)))
    published = ROOT / "pretrained/sit"
    found = assembly.Trained(published, read_manifest(published), experiment, {})
    assert judge_of(found) is None
    path, _ = checkpoint(tmp_path, experiment, 114)
    other = replace(experiment, style=StyleConfig(hidden=(16, 9)))
    with pytest.raises(CheckpointError, match="unknown form of its discriminator"):
        StyleJudge(path, other)

"""Networks that a training begins from, where an earlier version observed less."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from console.run import ancestors, assembly
from console.run.experiment import Experiment
from learner.ppo import Learner
from policy.checkpoints.format import Manifest, write
from policy.errors import LayoutError

NEW = ("near_box", "near_way", "near_right_hand", "near_left_hand")


def carrying() -> Experiment:
    base = Experiment()
    return replace(
        base, world=replace(base.world, task="carry"), ppo=replace(base.ppo, hidden=(16, 8))
    )


def test_networks_of_an_earlier_version_of_a_task_act_the_same(tmp_path: Path) -> None:
    experiment = carrying()
    mine = assembly.layout(experiment)
    theirs = replace(mine, goal=tuple(f for f in mine.goal if f[0] not in NEW))
    assert mine.observation - theirs.observation == 10
    old = Learner(theirs.observation, theirs.actions, experiment.ppo, 3)
    torch.manual_seed(0)
    rows = 2.0 + torch.randn(1000, theirs.observation)
    old.normaliser.update(rows)
    with torch.no_grad():
        old.actor.head.weight.normal_()
    path = write(tmp_path / "old", {"policy": old.policy_state()}, Manifest(theirs, 1, 1000))
    with pytest.raises(LayoutError, match="`train --init` carries its networks over"):
        mine.require(theirs, "old")

    _, state, task = ancestors.networks(path, experiment)
    assert task == "carry"
    new = assembly.learner(experiment)
    new.load_policy_state(state)
    state_width = sum(width for _, width in mine.features)
    first = state_width + 9  # behind box, target and way
    more = torch.randn(1000, 10)
    seen = torch.cat((rows[:, :first], more, rows[:, first:]), dim=1)
    torch.testing.assert_close(
        new.actor(new.normaliser(seen)), old.actor(old.normaliser(rows)), rtol=1e-5, atol=1e-5
    )

"""Networks carried over to another task act as before on what both tasks observe."""

from dataclasses import replace

import pytest
import torch

from learner.config import LearnerConfig
from learner.ppo import Learner
from policy.checkpoints.format import Layout
from policy.checkpoints.transfer import adopt
from policy.errors import LayoutError
from world.precision import FLOAT32

OLD = Layout("sit", (("height", 1), ("pose", 2)), (("target", 3), ("facing", 2)), 4, (8, 4))
NEW = Layout("carry", OLD.features, (("box", 3), ("target", 3), ("corner", 1)), 4, (8, 4))
NAMES = {"box": "target", "target": ""}


def learner(layout: Layout, seed: int) -> Learner:
    config = LearnerConfig(hidden=layout.hidden, skip=layout.skip)
    return Learner(layout.observation, layout.actions, config, seed, FLOAT32)


@pytest.fixture(params=[False, True])
def old(request: pytest.FixtureRequest) -> Learner:
    made = learner(replace(OLD, skip=request.param), 1)
    torch.manual_seed(0)
    rows = 3.0 + 2.0 * torch.randn(1_000_000, OLD.observation)
    made.normaliser.update(rows)
    made.values.update(rows[:, 0])
    with torch.no_grad():
        for actor in (made.actor, made.average):
            if actor.skip is not None:
                actor.skip.weight.normal_()
        for network in (made.actor, made.average, made.critic):
            network.layers[-1].weight.normal_()
            network.layers[0].bias.normal_()
    return made


def test_what_both_observe_gives_the_same_actions_and_values(old: Learner) -> None:
    new = learner(replace(NEW, skip=old.config.skip), 2)
    new.load_policy_state(adopt(old.policy_state(), OLD, NEW, NAMES, "there"))
    shared = torch.randn(50, 6)  # height, pose, and where to go
    facing, target, corner = (torch.randn(50, n) for n in (2, 3, 1))
    # as if the old task's own feature had its mean, which counts for nothing
    facing = old.normaliser.mean[6:].float().expand_as(facing)
    before = old.normaliser(torch.cat((shared, facing), 1))
    after = new.normaliser(torch.cat((shared, target, corner), 1))
    for name in ("actor", "average", "critic"):
        one, other = getattr(old, name)(before), getattr(new, name)(after)
        torch.testing.assert_close(other, one, rtol=1e-5, atol=1e-5)
    assert not new.actor.layers[0].weight[:, 6:].any(), "nothing is known of the new features"
    assert new.actor.layers[0].weight[:, :6].all()


def test_a_height_that_never_varied_is_known_from_the_root_alone() -> None:
    """In the old task the target is 0.9 m up: its z is that less the root's height."""
    layout = replace(OLD, features=(("root_height", 1), ("pose", 2)))
    theirs, mine = learner(layout, 1), learner(replace(layout, task="carry"), 2)
    rows = torch.randn(10_000, layout.observation)
    rows[:, 0] = 0.85 + 0.03 * rows[:, 0]
    rows[:, 5] = 0.9 - rows[:, 0]
    rows[:, 2] = 0.25  # a feature that never varied, whose weights are as they were drawn
    theirs.normaliser.update(rows)
    with torch.no_grad():
        for network in (theirs.actor, theirs.average, theirs.critic):
            network.layers[-1].weight.normal_()
    state = adopt(theirs.policy_state(), layout, layout, {}, "there", ("target",))
    mine.load_policy_state(state)
    some = rows[:50].clone()
    lower = some.clone()
    lower[:, 5] -= 0.4  # as on a seat
    lower[:, 2] += 0.1
    for name in ("actor", "average", "critic"):
        wanted = getattr(theirs, name)(theirs.normaliser(some))
        for observed in (some, lower):
            found = getattr(mine, name)(mine.normaliser(observed))
            torch.testing.assert_close(found, wanted, rtol=1e-4, atol=1e-4)
    # as it was before, the seat's height alone made nonsense of the outputs
    broken = theirs.actor(theirs.normaliser(lower)) - theirs.actor(theirs.normaliser(some))
    assert float(broken.detach().abs().mean()) > 0.5


def test_moments_of_the_old_task_fade_and_new_ones_begin_anew(old: Learner) -> None:
    moments = adopt(old.policy_state(), OLD, NEW, NAMES, "there")["normaliser"]
    assert moments["count"].tolist() == [2e5] * 6 + [0.0] * 4
    assert moments["mean"][6:].tolist() == [0.0] * 4
    assert moments["variance"][6:].tolist() == [1.0] * 4
    torch.testing.assert_close(moments["mean"][:6], old.normaliser.mean[:6])


def test_other_states_or_widths_are_refused_by_name(old: Learner) -> None:
    state = old.policy_state()
    others = {"features": (("height", 1),), "actions": 5, "hidden": (16, 4), "skip": True}
    for name, value in others.items():
        with pytest.raises(LayoutError, match=f"^there: its {name} differ from this task's"):
            adopt(state, OLD, replace(NEW, **{name: value}), NAMES, "there")

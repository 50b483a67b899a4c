"""Folding: the policy of one task out of a mixture's gives the same actions."""

from dataclasses import replace

import pytest
import torch

from learner.config import LearnerConfig
from learner.ppo import Learner
from policy.checkpoints.folding import Folding, folded
from policy.model.acting import Policy
from policy.model.normaliser import NormaliserConfig
from world.precision import FLOAT32

STATE, GOAL, ACTIONS = 6, 9, 4
HIDDEN = torch.zeros(STATE + GOAL, dtype=torch.bool)
HIDDEN[10:12] = True
OWN = torch.tensor([0, 1, 2, 3, 4, 5, 8, 7])


@pytest.mark.parametrize("skip", [False, True])
def test_actions_and_values_are_the_same(skip: bool) -> None:
    config = LearnerConfig(hidden=(16, 8), skip=skip, observation_clip=2.0)
    mixed = Learner(STATE + GOAL, ACTIONS, config, seed=1, precision=FLOAT32, hidden=HIDDEN)
    with torch.no_grad():
        for network in (mixed.actor, mixed.average, mixed.critic):
            for parameter in network.parameters():
                parameter.copy_(torch.randn_like(parameter))
    mixed.normaliser.update(torch.randn(500, STATE + GOAL) * 2.0 + 1.0)
    constant = torch.linspace(-9.0, 9.0, STATE + GOAL)  # some beyond the clip
    rows = constant.repeat(7, 1)
    rows[:, OWN] = 3.0 * torch.randn(7, len(OWN))

    limits = NormaliserConfig(config.observation_clip, config.observation_std_floor)
    state = folded(mixed.policy_state(), Folding(OWN, constant, HIDDEN), limits)
    alone = Learner(len(OWN), ACTIONS, config, seed=2, precision=FLOAT32)
    alone.load_policy_state(state)
    for ours, theirs in (
        (mixed.weights(), alone.weights()),
        (mixed.averaged_weights(), alone.averaged_weights()),
    ):
        whole = Policy(ours)(rows[:, :STATE], rows[:, STATE:])
        own = Policy(theirs)(rows[:, OWN[:STATE]], rows[:, OWN[STATE:]])
        torch.testing.assert_close(own, whole, rtol=1e-4, atol=1e-4)
    one = mixed._infer_values(mixed.normaliser(rows))
    other = alone._infer_values(alone.normaliser(rows[:, OWN]))
    torch.testing.assert_close(other, one, rtol=1e-4, atol=1e-3)


def test_the_actor_does_not_see_what_is_hidden_and_the_critic_does() -> None:
    config = LearnerConfig(hidden=(16, 8))
    mixed = Learner(STATE + GOAL, ACTIONS, config, seed=1, hidden=HIDDEN)
    rows = torch.randn(5, STATE + GOAL)
    other = torch.where(HIDDEN, rows + 3.0, rows)
    policy = Policy(mixed.weights())
    assert torch.equal(
        policy(rows[:, :STATE], rows[:, STATE:]), policy(other[:, :STATE], other[:, STATE:])
    )
    values = [mixed._infer_values(mixed.normaliser(x)) for x in (rows, other)]
    assert not torch.allclose(values[0], values[1])
    plain = replace(config)
    seeing = Policy(Learner(STATE + GOAL, ACTIONS, plain, seed=1).weights())
    assert not torch.allclose(
        seeing(rows[:, :STATE], rows[:, STATE:]), seeing(other[:, :STATE], other[:, STATE:])
    )

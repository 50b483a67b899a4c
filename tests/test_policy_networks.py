"""Networks and densities against other ways of computing them."""

import torch

from policy.acting import Policy, publish
from policy.networks import Actor, Critic, hidden_widths, log_density
from policy.normaliser import Normaliser
from policy.precision import Precision

FLOAT32 = Precision("cpu", None, "float32")


def test_shapes_and_small_first_actions():
    torch.manual_seed(0)
    actor, critic = Actor(143, 28, (64, 32)), Critic(143, (64, 32))
    x = torch.randn(10, 143)
    assert actor(x).shape == (10, 28)
    assert critic(x).shape == (10,)
    assert actor(x).abs().max() < 0.2


def test_widths_are_read_back_from_weights():
    actor = Actor(143, 28, (64, 32, 16))
    assert hidden_widths(dict(actor.state_dict())) == (143, 28, (64, 32, 16))


def test_log_density_agrees_with_torch_distributions():
    torch.manual_seed(1)
    mean, action = torch.randn(5, 28), torch.randn(5, 28)
    normal = torch.distributions.Normal(mean, 0.1)
    expected = normal.log_prob(action).sum(-1)
    torch.testing.assert_close(log_density(action, mean, 0.1), expected, rtol=1e-5, atol=1e-3)


def test_published_policy_acts_as_the_learners_network():
    torch.manual_seed(2)
    actor, normaliser = Actor(6, 2, (8, 4)), Normaliser(6)
    normaliser.update(torch.randn(100, 6) * 3 + 1)
    policy = Policy(publish(actor, normaliser), FLOAT32)
    state, goal = torch.randn(5, 4), torch.randn(5, 2)
    expected = actor(normaliser(torch.cat((state, goal), 1))).detach()
    assert torch.equal(policy(state, goal), expected)
    assert policy.actions == 2


def test_published_weights_do_not_follow_the_learner():
    actor, normaliser = Actor(6, 2, (8,)), Normaliser(6)
    weights = publish(actor, normaliser)
    before = weights["actor.layers.0.weight"].clone()
    with torch.no_grad():
        actor.layers[0].weight.add_(1.0)
    assert torch.equal(weights["actor.layers.0.weight"], before)

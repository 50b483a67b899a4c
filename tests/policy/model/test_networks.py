"""Networks and densities against other ways of computing them."""

import torch

from policy.model.networks import Actor, Critic, hidden_widths, log_density
from world.precision import decide


def test_shapes_and_small_first_actions():
    torch.manual_seed(0)
    actor, critic = Actor(143, 28, (64, 32)), Critic(143, (64, 32))
    x = torch.randn(10, 143)
    assert actor(x).shape == (10, 28)
    assert critic(x).shape == (10,)
    assert actor(x).abs().max() < 0.2


def test_under_autocast_only_the_head_keeps_float32():
    torch.manual_seed(3)
    actor, x = Actor(143, 28, (64, 32)), torch.randn(10, 143)
    actor.layers[-1].weight.data.normal_()
    bf16 = decide("cpu", frozenset({"amx_bf16"}))
    assert bf16.autocast is torch.bfloat16
    with bf16.context():
        means = actor(x)
        hidden = actor.layers[:-1](x)
    assert means.dtype is torch.float32 and hidden.dtype is torch.bfloat16
    head = actor.layers[-1]
    assert torch.equal(means, torch.nn.functional.linear(hidden.float(), head.weight, head.bias))
    # the eight bits of a bf16 number would round most of these
    assert (means.bfloat16().float() != means).float().mean() > 0.9


def test_widths_are_read_back_from_weights():
    actor = Actor(143, 28, (64, 32, 16))
    assert hidden_widths(dict(actor.state_dict())) == (143, 28, (64, 32, 16))


def test_what_skips_the_layers_is_added_in_float32():
    torch.manual_seed(5)
    actor, x = Actor(143, 28, (64, 32), skip=True), torch.randn(10, 143)
    assert actor.skip is not None and not actor.skip.weight.any()
    torch.nn.init.normal_(actor.skip.weight)
    plain = Actor.like({k: v for k, v in actor.state_dict().items() if k != "skip.weight"})
    assert plain.skip is None
    plain.load_state_dict({k: v for k, v in actor.state_dict().items() if k != "skip.weight"})
    with decide("cpu", frozenset({"amx_bf16"})).context():
        means, bent = actor(x), plain(x)
    torch.testing.assert_close(means, bent + x @ actor.skip.weight.T)
    again = Actor.like(actor.state_dict())
    again.load_state_dict(actor.state_dict())
    assert torch.equal(again(x), actor(x)) and again.actions == 28


def test_log_density_agrees_with_torch_distributions():
    torch.manual_seed(1)
    mean, action = torch.randn(5, 28), torch.randn(5, 28)
    normal = torch.distributions.Normal(mean, 0.1)
    expected = normal.log_prob(action).sum(-1)
    torch.testing.assert_close(log_density(action, mean, 0.1), expected, rtol=1e-5, atol=1e-3)

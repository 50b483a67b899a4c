"""The discriminator's network: seeds, its first logits, and its gradient in closed form."""

import torch

from discriminator.network import StyleNetwork


def network(seed: int = 0) -> StyleNetwork:
    return StyleNetwork(6, (16, 8), torch.Generator().manual_seed(seed))


def test_a_seed_fixes_the_weights() -> None:
    one = network()
    torch.manual_seed(5)  # the global stream has no part in them
    same, other = network(), network(1)
    assert all(torch.equal(a, b) for a, b in zip(one.parameters(), same.parameters(), strict=True))
    assert not torch.equal(one.linears[0].weight, other.linears[0].weight)


def test_the_first_rewards_are_about_log_two() -> None:
    logits = network()(torch.randn(1000, 6, generator=torch.Generator().manual_seed(1)))
    assert logits.shape == (1000,) and logits.abs().max() < 0.2


def test_the_closed_gradient_is_autograds() -> None:
    net = network()
    x = torch.randn(50, 6, generator=torch.Generator().manual_seed(2), requires_grad=True)
    logits, hidden = net.with_activations(x)
    (wanted,) = torch.autograd.grad(logits.sum(), x)
    torch.testing.assert_close(net.input_gradient(hidden), wanted)


def test_the_head_stays_in_float32_under_autocast() -> None:
    x = torch.randn(4, 6)
    with torch.autocast("cpu", torch.bfloat16):
        logits, hidden = network().with_activations(x)
    assert logits.dtype == torch.float32 and hidden[0].dtype == torch.bfloat16

"""Losses, reward, penalty, pairing and replay of the discriminator, against oracles."""

import math

import pytest
import torch

from discriminator import loss
from discriminator.network import StyleNetwork


def network(inputs: int = 6, hidden: tuple[int, ...] = (16, 8)) -> StyleNetwork:
    net = StyleNetwork(inputs, hidden, torch.Generator().manual_seed(3))
    with torch.no_grad():
        net.linears[-1].weight.mul_(30.0)  # away from the small first logits
    return net.double()


def test_reward_is_minus_log_one_minus_d_clamped_once() -> None:
    logits = torch.tensor([0.0, math.log(3.0), -20.0, 50.0])
    reward = loss.style_reward(logits, clamp=1e-4, scale=2.0)
    # D = 1/2 and 3/4: -log(1/2), -log(1/4); far left 0; far right -log(1e-4).
    assert reward.tolist() == pytest.approx(
        [2 * math.log(2), 2 * math.log(4), 0, 8 * math.log(10)], abs=1e-6
    )


def test_classification_by_hand() -> None:
    policy = torch.tensor([0.0, math.log(3.0)])  # -log(1-D): log 2, log 4
    mocap = torch.tensor([math.log(3.0)])  # -log D: log 4/3
    expected = 0.5 * (math.log(2) + math.log(4)) / 2 + 0.5 * math.log(4 / 3)
    assert float(loss.classification(policy, mocap)) == pytest.approx(expected)


@pytest.mark.parametrize("hidden", [(16,), (16, 8), (12, 10, 8)])
def test_closed_form_penalty_equals_double_backward(hidden: tuple[int, ...]) -> None:
    net = network(hidden=hidden)
    x = torch.randn(50, 6, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    _, activations = net.with_activations(x)
    ours = loss.gradient_penalty(net.input_gradient(activations))
    ours.backward()
    by_weight = [layer.weight.grad for layer in net.linears]

    reference = network(hidden=hidden)
    x.requires_grad_()
    (gradient,) = torch.autograd.grad(reference(x).sum(), x, create_graph=True)
    penalty = 0.5 * gradient.square().sum(-1).mean()
    penalty.backward()
    torch.testing.assert_close(ours, penalty)
    for grad, layer in zip(by_weight, reference.linears, strict=True):
        torch.testing.assert_close(grad, layer.weight.grad)


def test_regularisation_by_hand() -> None:
    net = StyleNetwork(1, (1,), torch.Generator().manual_seed(0))
    with torch.no_grad():
        net.linears[0].weight.fill_(2.0)
        net.linears[1].weight.fill_(3.0)
        net.linears[0].bias.fill_(100.0)
    total = loss.regularisation(net, logit=0.1, decay=0.01).item()
    assert total == pytest.approx(0.9 + 0.13)

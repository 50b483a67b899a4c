"""PPO's objectives and schedules against numbers worked by hand."""

import pytest
import torch

from learner.surrogate import (
    clipped_surrogate,
    imitation_loss,
    kl_fixed_sigma,
    mirror_loss,
    next_rate,
    soft_bound,
)


def test_surrogate_by_hand():
    ratio = torch.tensor([1.0, 2.0, 0.5, 2.0, 0.5])
    gain = torch.tensor([3.0, 1.0, 1.0, -1.0, -1.0])
    # min(r A, clip(r) A): 3, 1.2, 0.5, -2, -0.8
    found = clipped_surrogate(ratio.log(), gain, 0.2)
    assert float(found) == pytest.approx(-(3 + 1.2 + 0.5 - 2 - 0.8) / 5)


def test_surrogate_has_no_gradient_where_it_is_clipped():
    log_ratio = torch.tensor([2.0, 0.5, 2.0, 0.5]).log().requires_grad_()
    clipped_surrogate(log_ratio, torch.tensor([1.0, 1.0, -1.0, -1.0]), 0.2).backward()
    # d(-r A / 4)/d log r = -r A / 4 where it counts
    torch.testing.assert_close(log_ratio.grad, torch.tensor([0.0, -0.125, 0.5, 0.0]))


def test_soft_bound_by_hand():
    means = torch.tensor([[0.5, -1.0], [1.5, -3.0]])
    assert float(soft_bound(means)) == pytest.approx((0 + 0.25 + 4) / 2)


def test_kl_agrees_with_torch_distributions():
    torch.manual_seed(0)
    new, old = torch.randn(6, 28), torch.randn(6, 28)
    normal = torch.distributions.Normal
    expected = torch.distributions.kl_divergence(normal(old, 0.1), normal(new, 0.1)).sum(-1).mean()
    torch.testing.assert_close(kl_fixed_sigma(new, old, 0.1), expected)


def test_rate_follows_the_kl_within_bounds():
    bounds = (1e-5, 1e-3)
    assert next_rate(1e-4, 0.13, 0.06, bounds) == pytest.approx(1e-4 / 1.3)
    assert next_rate(1e-4, 0.029, 0.06, bounds) == pytest.approx(1.1e-4)
    assert next_rate(1e-4, 0.06, 0.06, bounds) == 1e-4
    assert next_rate(1.1e-5, 9.0, 0.06, bounds) == 1e-5
    assert next_rate(9.9e-4, 0.0, 0.06, bounds) == 1e-3


def test_mirror_loss_by_hand():
    means = torch.tensor([[0.0, 0.1], [0.3, 0.0]])
    wanted = torch.tensor([[0.05, 0.1], [0.0, -0.1]])
    # in sigmas of 0.1: (0.5, 0) and (3, 1): Huber 0.125 and 2.5 + 0.5, gated by 1 and 0.5
    found = mirror_loss(means, wanted, torch.tensor([1.0, 0.5]), 0.1)
    assert float(found) == pytest.approx((0.125 + 0.5 * 3.0) / 2)


def test_imitation_loss_by_hand():
    """Errors of half a sigma in one component and three in another; the rest is not labelled."""
    nan = float("nan")
    means = torch.tensor([[0.05, 0.3, 9.0], [1.0, 2.0, 3.0]], requires_grad=True)
    teacher_action = torch.tensor([[0.0, 0.0, nan], [nan, nan, nan]])
    found = imitation_loss(means, teacher_action, 0.1)
    assert float(found.detach()) == pytest.approx((0.5 * 0.5**2 + (3.0 - 0.5)) / 2, rel=1e-5)
    found.backward()
    assert means.grad is not None
    torch.testing.assert_close(means.grad[0], torch.tensor([0.5 / 0.1 / 2, 1 / 0.1 / 2, 0.0]))
    assert torch.equal(means.grad[1], torch.zeros(3))

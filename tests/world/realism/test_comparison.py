"""Comparisons of windows against closed forms, scipy and brute force."""

import numpy as np
import pytest
import torch
from scipy import linalg

from world.realism import comparison


def normal(count: int, features: int, seed: int) -> torch.Tensor:
    return torch.from_numpy(np.random.default_rng(seed).normal(size=(count, features)))


def test_frechet_agrees_with_scipy_and_a_shift_is_its_length() -> None:
    a = normal(300, 5, 0) @ normal(5, 5, 1)
    b = normal(400, 5, 2) @ normal(5, 5, 3) + 0.7
    first, second = np.cov(a.numpy().T), np.cov(b.numpy().T)
    mean = a.mean(0).numpy() - b.mean(0).numpy()
    root = linalg.sqrtm(first @ second).real
    expected = mean @ mean + np.trace(first + second - 2 * root)
    assert comparison.frechet(a, b) == pytest.approx(expected**0.5, rel=1e-6)
    assert comparison.frechet(a, a) == pytest.approx(0.0, abs=1e-6)
    assert comparison.frechet(a, a + torch.tensor([3.0, 4.0, 0, 0, 0])) == pytest.approx(5.0)


def test_area_counts_pairs_and_ties_half() -> None:
    positive, negative = torch.tensor([0.1, 0.4, 0.4]), torch.tensor([0.4, 0.0])
    pairs = [(p > n) + 0.5 * (p == n) for p in positive.tolist() for n in negative.tolist()]
    assert comparison.area(positive, negative) == pytest.approx(sum(pairs) / 6)


def test_coverage_by_hand() -> None:
    """On a line of unit steps the fifth neighbour of an inner point is 3 away, of an end 5."""
    line = torch.arange(20.0)[:, None]
    assert comparison.coverage(line, line) == 1.0
    # a row at 10 is within 3 of 7 to 13, and within 4 or 5 of no point near an end
    assert comparison.coverage(torch.tensor([[10.0]]), line) == pytest.approx(7 / 20)
    assert comparison.coverage(torch.tensor([[99.0]]), line) == 0.0
    assert np.isnan(comparison.coverage(torch.zeros(0, 1), line))


def test_one_distribution_is_not_separable_and_two_are() -> None:
    same = comparison.separability(
        (normal(500, 8, 0), normal(500, 8, 1)), (normal(500, 8, 2), normal(500, 8, 3))
    )
    assert 0.4 < same < 0.6
    apart = comparison.separability(
        (normal(500, 8, 0), 3.0 * normal(500, 8, 1)), (normal(500, 8, 2), 3.0 * normal(500, 8, 3))
    )
    assert apart > 0.95  # equal means: a linear classifier could not
    assert np.isnan(
        comparison.separability((normal(5, 8, 0), normal(0, 8, 1)), (same_rows(), same_rows()))
    )


def same_rows() -> torch.Tensor:
    return normal(5, 8, 0)


def test_a_basis_scales_by_the_reference_and_no_less_than_stated() -> None:
    reference = normal(200, 6, 4) * torch.tensor([2.0, 1, 1, 1, 1, 1e-6])
    basis = comparison.basis(reference, torch.full((6,), 0.01), 3)
    assert basis.scale[0] == pytest.approx(float(reference[:, 0].std()))
    assert float(basis.scale[5]) == pytest.approx(0.01)
    torch.testing.assert_close(basis.components.T @ basis.components, torch.eye(3).double())
    assert basis.project(reference).mean(0).abs().max() < 1e-9
    with pytest.raises(ValueError, match="at least 2 windows"):
        comparison.basis(reference[:1], torch.zeros(6))

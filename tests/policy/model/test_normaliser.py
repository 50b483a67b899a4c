"""Running moments against the moments of all rows at once."""

import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from policy.model.normaliser import Normaliser, NormaliserConfig, ValueNormaliser


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(0, 40), min_size=1, max_size=6), st.integers(0, 2**31))
def test_any_division_into_batches_gives_the_moments_of_all(sizes, seed):
    generator = torch.Generator().manual_seed(seed)
    batches = [torch.randn(n, 3, generator=generator) * 5 + 100 for n in sizes]
    normaliser = Normaliser(3)
    for batch in batches:
        normaliser.update(batch)
    rows = torch.cat(batches).double()
    assert normaliser.count[0] == len(rows)
    if len(rows):
        torch.testing.assert_close(normaliser.mean, rows.mean(0))
        torch.testing.assert_close(normaliser.variance, rows.var(0, correction=0))


def test_large_offset_keeps_its_small_variance():
    normaliser = Normaliser(1)
    values = torch.tensor([[1e6], [1e6 + 1], [1e6 + 2]], dtype=torch.float64)
    for row in values:
        normaliser.update(row[None])
    assert abs(float(normaliser.variance[0]) - 2 / 3) < 1e-6


def test_by_hand():
    normaliser = Normaliser(2, NormaliserConfig(clip=5.0, std_floor=0.01))
    normaliser.update(torch.tensor([[1.0, 7.0], [3.0, 7.0]]))
    # column 0: mean 2, std 1; column 1: constant, std at the floor of 0.01
    out = normaliser(torch.tensor([[4.0, 7.02], [2.0, 8.0], [-9.0, 7.0]]))
    torch.testing.assert_close(
        out, torch.tensor([[2.0, 2.0], [0.0, 5.0], [-5.0, 0.0]]), atol=1e-4, rtol=0
    )


def test_state_restores_exactly():
    one, other = Normaliser(4), Normaliser(4)
    one.update(torch.randn(50, 4))
    other.load_state_dict(one.state_dict())
    batch = torch.randn(20, 4)
    one.update(batch)
    other.update(batch)
    assert torch.equal(one.variance, other.variance) and torch.equal(one.mean, other.mean)


def test_values_return_from_their_units():
    values = ValueNormaliser()
    assert values.fresh
    values.update(torch.tensor([10.0, 14.0]))
    assert (values.mean, values.std) == (12.0, 2.0)
    assert not values.fresh
    torch.testing.assert_close(values.normalise(torch.tensor([16.0])), torch.tensor([2.0]))
    torch.testing.assert_close(values.denormalise(torch.tensor([2.0])), torch.tensor([16.0]))


def test_old_returns_fade():
    values = ValueNormaliser(memory=100)
    values.update(torch.zeros(1000))
    values.update(torch.full((100,), 2.0))
    assert abs(values.mean - 1.0) < 1e-12

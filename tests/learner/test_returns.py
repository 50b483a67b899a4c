"""Advantages against sums worked by hand."""

import pytest
import torch

from learner.returns import advantages, explained_variance, mixed_reward

GAMMA, LAM = 0.5, 0.5


def column(*numbers: float) -> torch.Tensor:
    return torch.tensor(numbers, dtype=torch.float32)[:, None]


def flags(*numbers: int) -> torch.Tensor:
    return torch.tensor(numbers, dtype=torch.bool)[:, None]


NO = flags(0, 0, 0)
YES = ~NO


def test_uninterrupted():
    # errors: 1 + .5*4 - 2 = 1, 2 + .5*6 - 4 = 1, 3 + .5*8 - 6 = 1; decay .25
    found = advantages(column(1, 2, 3), column(2, 4, 6), column(4, 6, 8), NO, NO, YES, GAMMA, LAM)
    torch.testing.assert_close(found, column(1 + 0.25 * 1.25, 1.25, 1))


def test_fall_is_worth_nothing_afterwards_and_cuts_the_sum():
    found = advantages(
        column(1, 2, 3), column(2, 4, 6), column(4, 100, 8), flags(0, 1, 0), NO, YES, GAMMA, LAM
    )
    # t = 1: 2 - 4 = -2, whatever the next value; t = 0: 1 + .25 * -2
    torch.testing.assert_close(found, column(0.5, -2, 1))


def test_time_out_keeps_the_value_of_its_last_state_and_cuts_the_sum():
    found = advantages(
        column(1, 2, 3), column(2, 4, 6), column(4, 100, 8), NO, flags(0, 1, 0), YES, GAMMA, LAM
    )
    # t = 1: 2 + .5*100 - 4 = 48; t = 0: 1 + .25 * 48
    torch.testing.assert_close(found, column(13, 48, 1))


def test_a_fall_outweighs_a_time_out_of_the_same_step():
    both = flags(0, 1, 0)
    found = advantages(
        column(1, 2, 3), column(2, 4, 6), column(4, 100, 8), both, both, YES, GAMMA, LAM
    )
    torch.testing.assert_close(found[1], torch.tensor([-2.0]))


def test_invalid_samples_are_nothing_and_pass_nothing_on():
    nan = float("nan")
    found = advantages(
        column(1, nan, 3), column(2, 4, 6), column(4, nan, 8), NO, NO, flags(1, 0, 1), GAMMA, LAM
    )
    # t = 0 bootstraps with V(s_1) = 4, the last finite state: 1 + .5*4 - 2
    torch.testing.assert_close(found, column(1, 0, 1))


def test_against_the_sum_of_discounted_rewards():
    """With lam = 1 the advantage is the discounted return, less the value."""
    generator = torch.Generator().manual_seed(0)
    rewards, values = torch.rand(6, 3, generator=generator), torch.rand(7, 3, generator=generator)
    none = torch.zeros(6, 3, dtype=torch.bool)
    found = advantages(rewards, values[:-1], values[1:], none, none, ~none, 0.9, 1.0)
    for t in range(6):
        total = sum(0.9 ** (k - t) * rewards[k] for k in range(t, 6)) + 0.9 ** (6 - t) * values[6]
        torch.testing.assert_close(found[t], total - values[t])


def test_scenes_do_not_mix():
    generator = torch.Generator().manual_seed(0)
    rewards, values, following = torch.rand(3, 4, 5, generator=generator)
    fell, timed_out, invalid = torch.rand(3, 4, 5, generator=generator) < 0.2
    whole = advantages(rewards, values, following, fell, timed_out, ~invalid, 0.9, 0.8)
    for n in range(5):
        one = [x[:, n : n + 1] for x in (rewards, values, following, fell, timed_out, ~invalid)]
        torch.testing.assert_close(whole[:, n : n + 1], advantages(*one, 0.9, 0.8))


def test_mixed_reward():
    task, style = column(1.0, 2.0), column(0.5, 0.0)
    torch.testing.assert_close(mixed_reward(task, style, 0.6, 0.4), column(0.8, 1.2))
    torch.testing.assert_close(mixed_reward(task, None, 0.6, 0.4), column(0.6, 1.2))


def test_explained_variance():
    target = torch.tensor([1.0, 2.0, 3.0])
    assert explained_variance(target, target) == 1.0
    assert explained_variance(torch.full((3,), 9.0), target) == pytest.approx(0.0)
    assert explained_variance(-target, target) == pytest.approx(-3.0)
    assert explained_variance(target, torch.ones(3)) == 0.0

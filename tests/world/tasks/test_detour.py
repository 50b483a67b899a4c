"""The detour round the stand that a box was taken from."""

import math

import pytest
import torch
from torch import Tensor

from world.tasks import detour
from world.tasks.detour import ROUND_M

STAND, GOAL = torch.zeros(1, 2), torch.tensor([[5.0, 0.0]])


def at(x: float, y: float) -> Tensor:
    return torch.tensor([[x, y]])


def test_the_way_round_a_stand() -> None:
    """From the circle's point opposite the goal it is the arc to the goal's tangent, and that."""
    behind = float(detour.extra_m(at(-ROUND_M, 0.0), STAND, GOAL))
    tangent = math.sqrt(25.0 - ROUND_M**2)
    arc = ROUND_M * (math.pi - math.acos(ROUND_M / 5.0))
    assert behind == pytest.approx(arc + tangent - 5.55, abs=1e-5) == pytest.approx(0.344, abs=1e-3)
    # who stands nearer goes straight out first
    nearer = float(detour.extra_m(at(-0.40, 0.0), STAND, GOAL))
    assert nearer == pytest.approx(behind + 2 * 0.15, abs=1e-5)
    for x, y in ((1.0, 0.0), (0.0, 1.0), (-2.0, 1.0)):  # no stand is between
        assert detour.extra_m(at(x, y), STAND, GOAL) == pytest.approx(0.0, abs=1e-5)


def test_steps_aside_and_back_from_the_stand_are_steps_on_the_way() -> None:
    """A character at 0.45 m from the middle of a stand, its target 5 m beyond it."""
    root = at(-0.45, 1e-4)
    back, aside, on = (
        float(detour.closing_m_s(root, at(x, y), STAND, GOAL))
        for x, y in ((-0.5, 0.0), (0.0, 0.5), (0.5, 0.0))
    )
    # straight out of the circle, and 0.5 m/s that the straight way lost
    assert back == pytest.approx(1.0, abs=1e-3)
    assert aside == pytest.approx(0.5 * 0.55 / 0.45, abs=1e-3)
    assert on == pytest.approx(-1.0, abs=1e-3)


def test_the_speed_is_the_rate_of_the_way_so_that_no_circle_earns() -> None:
    generator = torch.Generator().manual_seed(0)
    n, step_s = 4096, 1e-5
    root = (4.0 * torch.rand(n, 2, generator=generator) - 2.0).double()
    goal = (8.0 * torch.rand(n, 2, generator=generator) - 4.0).double()
    velocity = torch.randn(n, 2, generator=generator).double()
    known = (goal.norm(dim=1) > ROUND_M) & (root.norm(dim=1) > 0.21)
    root, goal, velocity = root[known], goal[known], velocity[known]
    stand = torch.zeros_like(root)
    before, after = (
        detour.extra_m(root + sign * step_s * velocity, stand, goal) for sign in (-1.0, 1.0)
    )
    rate = (before - after) / (2.0 * step_s)
    found = detour.closing_m_s(root, velocity, stand, goal)
    assert (found - rate).abs().quantile(0.999) < 1e-4
    assert (found != 0.0).double().mean() > 0.15


def test_everything_is_finite_where_points_coincide() -> None:
    for root in (STAND, GOAL, at(-ROUND_M, 0.0), at(1e-9, 0.0)):
        for goal in (GOAL, STAND):
            assert detour.extra_m(root, STAND, goal).isfinite()
            assert detour.closing_m_s(root, at(1.0, -1.0), STAND, goal).isfinite()

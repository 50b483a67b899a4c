"""Footprints: the edge to get on at, with and without a notch before the use point."""

import math

import pytest
import torch
from torch import Tensor

from world.objects.footprint import Footprint


def corners(right_m: float, left_m: float, degrees: float = 0.0) -> Tensor:
    """Of a piece from 0.5 m behind the use point to right_m ahead on its right, left_m on its left,
    0.8 m to both sides, turned by `degrees` against its facing."""
    points = [(-0.5, -0.8), (-0.5, 0.8), (right_m, -0.8), (left_m, 0.8)]
    flat = torch.tensor([point for point in points for _ in range(2)])
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return (flat @ torch.tensor([[c, s], [-s, c]]))[None]


@pytest.mark.parametrize(
    ("right_m", "left_m", "edge_m", "aside_m"),
    [(0.3, 0.3, 0.3, 0.0), (1.0, 0.3, 0.3, 0.3), (0.3, 1.0, 0.3, -0.3), (0.3, 0.38, 0.38, 0.0)],
)
def test_one_gets_on_in_the_notch(
    right_m: float, left_m: float, edge_m: float, aside_m: float
) -> None:
    ground = Footprint.of(corners(right_m, left_m))
    torch.testing.assert_close(ground.low, torch.tensor([[-0.5, -0.8]]))
    torch.testing.assert_close(ground.high, torch.tensor([[max(right_m, left_m), 0.8]]))
    assert float(ground.edge) == pytest.approx(edge_m)
    assert float(ground.aside) == pytest.approx(aside_m)


def test_a_rectangle_askew_has_no_notch() -> None:
    ground = Footprint.of(corners(0.3, 0.3, 20.0))
    assert float(ground.aside) == 0.0
    assert float(ground.edge) == float(ground.high[0, 0])

"""Boxes in the hands: quarter turns, edges along the hands, and sizes with variants."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from world import rotations
from world.teachers.boxes import half_turned, quarter_turns, sizes


@pytest.mark.parametrize(("degrees", "turns"), [(0, 0), (40, 0), (95, 3), (-80, 1), (170, 2)])
def test_the_axis_nearest_to_the_heading_is_the_box_s_first(degrees: int, turns: int) -> None:
    """Turned by so many quarters, the box's x axis is within 45 degrees of the heading."""
    heading = rotations.cos_sin(torch.tensor([0.7]))
    rotation = rotations.from_heading(
        rotations.cos_sin(torch.tensor([0.7 + math.radians(degrees)]))
    )
    found = quarter_turns(heading, rotation)
    assert found.tolist() == [turns]
    left = math.radians(degrees) + turns * math.pi / 2
    assert abs(math.remainder(left, 2 * math.pi)) <= math.pi / 4


def test_odd_quarters_exchange_length_and_width() -> None:
    half = torch.tensor([[0.1, 0.2, 0.3], [0.1, 0.2, 0.3], [0.1, 0.2, 0.3]])
    found = half_turned(half, torch.tensor([0, 1, 2]))
    wanted = torch.tensor([[0.1, 0.2, 0.3], [0.2, 0.1, 0.3], [0.1, 0.2, 0.3]])
    torch.testing.assert_close(found, wanted)


def test_boxes_of_nearly_one_width_share_a_size_and_either_pair_of_faces_may_be_held() -> None:
    """Widths 0.40, 0.44 and 0.46 m: the second is within a factor of 1.12 of the first."""
    half = torch.tensor([[0.10, 0.23, 0.15], [0.10, 0.20, 0.15], [0.10, 0.22, 0.15]])
    found = sizes(SimpleNamespace(half=half, mass=torch.ones(3)))
    wanted = [[0.2, 0.4, 0.3], [0.4, 0.2, 0.3], [0.2, 0.46, 0.3], [0.46, 0.2, 0.3]]
    np.testing.assert_allclose(found, wanted, atol=1e-6)

"""The hands: where they hold a box."""

from dataclasses import replace

import pytest
import torch

from tests.support.walking import box_at
from world.character import model as character
from world.teachers.scripted import handling
from world.teachers.scripted.whole_body import Figure


@pytest.fixture(autouse=True)
def one_thread() -> None:
    torch.set_num_threads(1)


def test_hands_hold_high_but_below_the_edge() -> None:
    """Half of the half height up, and at least 6 cm below the edge; in the middle of flat boxes."""
    crate = box_at((0.4, 0.0), (3.0, 0.0))
    figure = Figure.of(torch.from_numpy(character.standing_qpos())[None], torch.zeros(1, 34))
    for half_m, expected in ((0.2, 0.1), (0.08, 0.02), (0.05, 0.0)):
        flat = replace(crate, half=torch.tensor([[0.175, 0.25, half_m]]).double())
        reach = handling.reach(figure, flat, torch.ones(1).double(), torch.tensor([False]))
        up = reach.goal[0, :, 2] - flat.position[0, 2]
        torch.testing.assert_close(up, torch.full((2,), expected).double())

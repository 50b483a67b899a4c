"""The path: faces, the way round stands, and where it ends."""

import math

import pytest
import torch
from torch import Tensor

from tests.support.walking import box_at, feet_at
from world import rotations
from world.scene.target import BoxState
from world.teachers.scripted import path
from world.teachers.scripted.gait import Footing, unit


@pytest.fixture(autouse=True)
def one_thread() -> None:
    torch.set_num_threads(1)


NO, YES = torch.tensor([False]), torch.tensor([True])


def test_the_nearest_narrow_face_is_chosen_and_kept() -> None:
    crate = box_at((0.0, 0.0), (5.0, 0.0))
    none = torch.tensor([-1])
    for root, face in (((-2.0, 0.0), 0), ((2.0, 0.0), 1), ((0.3, -2.0), 2), ((0.3, 2.0), 3)):
        found = path.choose(torch.tensor([root]).double(), crate, none)
        assert found.item() == face
    # before a wide face the face towards the target is better, but not enough for a change
    corner = torch.tensor([[0.1, -1.5]]).double()
    assert path.choose(corner, crate, none).item() == 0
    assert path.choose(corner, crate, torch.tensor([2])).item() == 2
    view = path.view(feet_at(-2.0, 0.0, 0.0), unit(torch.zeros(1).double()), crate, none + 1)
    # at least 20 cm from the centre, plus the gap
    torch.testing.assert_close(view.pick_up_point, torch.tensor([[-0.36, 0.0]]).double())
    assert view.off_pick_up_m.item() == pytest.approx(1.64)


def step(
    feet: Footing, crate: BoxState, face: int, carrying: Tensor, straight: Tensor
) -> list[float]:
    view = path.view(feet, feet.heading, crate, torch.tensor([face]))
    return path.step_command(view, crate, carrying, straight)[0].tolist()


def test_the_path_goes_straight_or_round_the_box() -> None:
    far = box_at((3.0, 0.0), (9.0, 9.0))
    assert step(feet_at(0.0, 0.0, 0.0), far, 0, NO, NO) == pytest.approx([0.45, 0.0, 0.0])
    # to the face at its back, past it at 0.62 m; shorter by the turn over 1.8 rad
    near = box_at((2.0, 0.0), (9.0, 9.0))
    turn = math.asin(0.62 / 2.0)
    ahead = 0.45 * (1.0 - turn / 1.8)
    expected = [ahead, 0.0, turn * (1.0 - ahead / 0.9)]
    assert step(feet_at(0.0, 0.0, 0.0), near, 1, NO, NO) == pytest.approx(expected)
    # before the face, 20 cm short of its place and 5 cm to the right, turned by 0.1
    view = feet_at(2.0 - 0.36 - 0.2, -0.05, 0.1)
    seen = rotations.turn_back(view.heading, torch.tensor([[0.2, 0.05]]).double())[0]
    expected = [0.8 * float(seen[0]), 0.7 * float(seen[1]), -0.1]
    assert step(view, near, 0, NO, YES) == pytest.approx(expected)


@pytest.mark.parametrize("began", [-0.3, 0.3])
@pytest.mark.parametrize("aside", [-0.1, 0.1])
def test_a_turn_under_way_decides_the_side_of_a_stand(began: float, aside: float) -> None:
    """With a target right behind the stand, whichever side is a little nearer."""
    crate = box_at((0.7, 0.0), (4.0, aside))
    turn = step(feet_at(0.0, 0.0, began), crate, 0, YES, NO)[2]
    assert math.copysign(1.0, turn) == math.copysign(1.0, began) and abs(turn) > 0.2
    # a target well to the other side reverses the turn
    crate = box_at((0.7, 0.0), (4.0, -math.copysign(2.0, began)))
    assert step(feet_at(0.0, 0.0, began), crate, 0, YES, NO)[2] * began < 0.0


def test_with_the_box_the_path_leaves_backwards_and_ends_before_the_target() -> None:
    crate = box_at((0.4, 0.0), (0.4, 3.0))
    assert step(feet_at(0.0, 0.0, 0.0), crate, 0, YES, NO) == pytest.approx([-0.24, 0.0, 0.0])
    # 1.25 m off sideways: a box 25 cm deep that way is put down from 44 cm before
    there = feet_at(0.4, 3.0 - 0.25 - 0.19 - 0.03, math.pi / 2)
    view = path.view(there, there.heading, crate, torch.tensor([0]))
    assert view.left_m.item() == pytest.approx(0.03)
    assert path.arrived(view, YES, NO).item() and path.at_target(view).item()
    beyond = feet_at(0.4, 3.0 - 0.25 - 0.19 - 0.14, math.pi / 2)
    view = path.view(beyond, beyond.heading, crate, torch.tensor([0]))
    assert not path.arrived(view, YES, NO).item()
    assert path.arrived(view, YES, YES).item(), "a small distance does not end a stop"

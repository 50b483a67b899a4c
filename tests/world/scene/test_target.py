"""Targets: corners of a turned box by hand, rows read and written, and the features of a state."""

import math

import torch

from world.character import features
from world.character import model as character
from world.scene.target import BoxState, Target, state


def boxes(n: int = 2) -> BoxState:
    half = math.pi / 4  # a quarter turn about z
    rotation = torch.tensor([[math.cos(half), 0.0, 0.0, math.sin(half)]]).repeat(n, 1)
    position = torch.arange(3.0 * n).reshape(n, 3)
    size = torch.tensor([[0.1, 0.2, 0.3]]).repeat(n, 1)
    return BoxState(position, rotation, torch.zeros(n, 3), size, position + 1, position + 2)


def with_box(n: int = 2) -> Target:
    box = boxes(n)
    facing = torch.tensor([[0.0, 1.0]]).repeat(n, 1)
    return Target(box.target.clone(), facing, box.corners(), box.target.clone(), box)


def test_corners_of_a_box_that_is_turned() -> None:
    box = boxes(1)
    corners = box.corners() - box.position[:, None]
    # low first, z fastest: the first corner is (-0.1, -0.2, -0.3), turned to (0.2, -0.1, -0.3)
    wanted = torch.tensor([[0.2, -0.1, -0.3], [0.2, -0.1, 0.3], [-0.2, -0.1, -0.3]])
    torch.testing.assert_close(corners[0, :3], wanted, atol=1e-6, rtol=0)


def test_rows_are_read_and_written() -> None:
    whole = with_box()
    one = whole.rows(torch.tensor([1]))
    assert one.box is not None and whole.box is not None and one.head is not None
    assert torch.equal(one.box.target, whole.box.target[1:])
    whole.write(torch.tensor([0]), one)
    for name, value in whole.tensors().items():
        assert torch.equal(value[0], value[1]), name
    assert set(whole.tensors()) == {
        "point", "facing", "corners", "head", "box_half", "box_start", "box_target",
    }  # fmt: skip


def test_the_state_is_of_the_furniture_or_of_the_box() -> None:
    qpos = torch.from_numpy(character.standing_qpos()).float()[None]
    body = features.body(qpos, torch.zeros(1, character.NV))
    box = with_box(1)
    assert box.box is not None
    seat = Target(box.point, box.facing, box.corners)
    plain, carried = state(body, seat), state(body, box)
    assert plain.shape == carried.shape == (1, 114)
    assert torch.equal(plain[:, : body.features.shape[1]], carried[:, : body.features.shape[1]])
    # the object's frame is on the floor below the point of use; the box's is its centre
    root_z = float(body.root[0, 2])
    offset = plain[0, features.OBJECT][:3]
    torch.testing.assert_close(offset, torch.tensor([2.0, 3.0, -root_z]), atol=1e-5, rtol=0)
    offset = carried[0, features.OBJECT][:3]
    torch.testing.assert_close(offset, torch.tensor([0.0, 1.0, 2.0 - root_z]), atol=1e-5, rtol=0)

"""Boxes of messages: size, layout, and what no box may be."""

import math

import numpy as np
import pytest
import torch

from policy.errors import RequestError
from policy.objects import adapter, props_of
from policy.objects.box import carried, fill_box, size_of
from policy.objects.columns import COLUMNS, POSE_WIDTH
from rpc.v1 import policy_pb2 as pb
from world import tasks
from world.scene.batch import Scenes
from world.scene.box import BOX_KG

CARRY = tasks.make("carry")


def box(**changes: object) -> pb.CarriedBox:
    half = math.pi / 6
    whole = {
        "size": [0.35, 0.5, 0.3],
        "position": [1.0, 2.0, 0.75],
        "rotation": [math.cos(half), 0.0, 0.0, math.sin(half)],
        "velocity": [0.1, 0.2, 0.3],
        "start": [1.0, 2.0, 0.75],
        "goal": [4.0, 2.0, 0.55],
    }
    return pb.CarriedBox(**(whole | changes))  # pyright: ignore


def test_a_row_holds_what_the_message_says() -> None:
    row = np.zeros(POSE_WIDTH)
    fill_box(row, box(), "s.box")
    np.testing.assert_allclose(row[COLUMNS["box_half"]], [0.175, 0.25, 0.15])
    np.testing.assert_allclose(row[COLUMNS["box_target"]], [4.0, 2.0, 0.55])
    np.testing.assert_allclose(row[COLUMNS["box_velocity"]], [0.1, 0.2, 0.3])
    assert np.linalg.norm(row[COLUMNS["box_rotation"]]) == pytest.approx(1.0)
    with pytest.raises(RequestError, match=r"^s\.box\.goal: 2 numbers, must be 3"):
        fill_box(row, box(goal=[0.0, 1.0]), "s.box")


def test_a_box_rests_on_its_stand() -> None:
    size, layout = carried(box())
    assert size.tolist() == pytest.approx([0.35, 0.5, 0.3])
    torch.testing.assert_close(layout.position, torch.tensor([[1.0, 2.0, 0.75]]))
    torch.testing.assert_close(layout.start, layout.position)
    yaw = torch.tensor([[math.cos(math.pi / 3), math.sin(math.pi / 3)]])
    torch.testing.assert_close(layout.start_yaw, yaw)
    assert not layout.velocity.any()


def test_what_no_box_may_be() -> None:
    for size in ([0.04, 0.5, 0.3], [0.3, 2.1, 0.3], [0.3, 0.3], [0.3, math.nan, 0.3]):
        with pytest.raises(RequestError, match=r"^box\.size"):
            size_of(box(size=size), "box")
    for field, low in (("position", [1.0, 2.0, 0.1]), ("goal", [4.0, 2.0, 0.14])):
        with pytest.raises(RequestError, match=rf"^box\.{field}\[2\].*half the box's height"):
            carried(box(**{field: low}))


def test_a_boxs_point_of_use_is_its_target() -> None:
    row = torch.zeros(1, POSE_WIDTH)
    row[:, COLUMNS["box_rotation"]] = torch.tensor([1.0, 0.0, 0.0, 0.0])
    row[:, COLUMNS["box_half"]] = torch.tensor([0.1, 0.2, 0.3])
    row[:, COLUMNS["box_target"]] = torch.tensor([4.0, 5.0, 0.6])
    target = adapter(CARRY).target(row)
    assert target.box is not None and target.point[0].tolist() == [4.0, 5.0, 0.6000000238418579]
    torch.testing.assert_close(target.corners[0].amax(0), torch.tensor([0.1, 0.2, 0.3]))


def test_a_box_weighs_by_its_volume_and_goes_with_its_stand() -> None:
    message = pb.CarriedBox(size=[0.35, 0.5, 0.15], position=[2.0, 0.0, 0.6], goal=[4.0, 0.0, 0.6])
    props = props_of(pb.SynthesizeRequest(box=message), CARRY)
    scenes = Scenes([props.model], 0.35, 3.0)
    props.begin(scenes)
    assert props.model.body("box").mass[0] == pytest.approx(BOX_KG / 2)
    there = torch.tensor([[3.0, -2.0]])
    props.shift(scenes, there, torch.tensor([[1.0, 0.0]]))
    torch.testing.assert_close(props.use_point()[0], there)
    assert props.pose(scenes)[0] == pytest.approx([3.0, -2.0, 0.6])


def test_a_move_takes_the_stand_and_the_box_on_it_to_a_place_at_its_height() -> None:
    """A move of the stand alone would leave the box in the air, and the reward at the old place."""
    message = pb.CarriedBox(size=[0.35, 0.5, 0.3], position=[2.0, 0.0, 0.6], goal=[4.0, 0.0, 0.6])
    props = props_of(pb.SynthesizeRequest(box=message), CARRY)
    scenes = Scenes([props.model], 0.35, 3.0)
    props.begin(scenes)
    props.move(scenes, np.array([3.0, -2.0, 0.0]), math.pi / 2)
    assert props.pose(scenes)[0] == pytest.approx([3.0, -2.0, 0.6])
    box_state = props.target(scenes).box
    assert box_state is not None
    torch.testing.assert_close(box_state.start, torch.tensor([[3.0, -2.0, 0.6]]))
    for _ in range(30):  # the stand is there too: nothing falls
        scenes.act(torch.zeros(1, 28))
    assert props.pose(scenes)[0] == pytest.approx([3.0, -2.0, 0.6], abs=0.01)

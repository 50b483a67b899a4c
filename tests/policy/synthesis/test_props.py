"""What stands in a simulated scene is put where the request has it, and goes where it is told."""

import math

import pytest
import torch
from policy.synthesis.props import Boxed, FurnitureArrangement, props_of

from policy.errors import RequestError
from rpc.v1 import policy_pb2 as pb
from tests.support.policy_cases import SIT, chair
from world import tasks
from world.scene.batch import Scenes
from world.scene.box import BOX_KG

CARRY = tasks.make("carry")


def begun(
    request: pb.SynthesizeRequest, task: tasks.Task
) -> tuple[FurnitureArrangement | Boxed, Scenes]:
    props = props_of(request, task)
    assert isinstance(props, FurnitureArrangement | Boxed)
    scenes = Scenes([props.model], 0.35, 3.0)
    props.begin(scenes)
    return props, scenes


def test_furniture_is_moved_by_its_spot() -> None:
    props, scenes = begun(pb.SynthesizeRequest(furniture=chair(2.0, 1.0, 0.5)), SIT)
    point, facing = props.spot()
    torch.testing.assert_close(props.place(scenes).point[:, :2], point)
    there, turned = torch.tensor([[-1.0, 3.0]]), torch.tensor([[math.cos(2.0), math.sin(2.0)]])
    props.shift(scenes, there, turned)
    moved, faces = props.spot()
    torch.testing.assert_close(moved, there)
    torch.testing.assert_close(faces, turned)
    torch.testing.assert_close(props.place(scenes).facing, turned)
    assert not torch.equal(facing, faces)
    position, rotation = props.pose(scenes)
    assert scenes.physics()["mocap_pos"].reshape(-1)[:3].tolist() == pytest.approx(position)
    assert math.hypot(*rotation) == pytest.approx(1.0)


def test_a_box_weighs_by_its_volume_and_goes_with_its_stand() -> None:
    box = pb.CarriedBox(size=[0.35, 0.5, 0.15], position=[2.0, 0.0, 0.6], goal=[4.0, 0.0, 0.6])
    props, scenes = begun(pb.SynthesizeRequest(box=box), CARRY)
    assert props.model.body("box").mass[0] == pytest.approx(BOX_KG / 2)
    there = torch.tensor([[3.0, -2.0]])
    props.shift(scenes, there, torch.tensor([[1.0, 0.0]]))
    torch.testing.assert_close(props.spot()[0], there)
    assert props.pose(scenes)[0] == pytest.approx([3.0, -2.0, 0.6])


def test_what_is_missing_is_named() -> None:
    with pytest.raises(RequestError, match=r"^box: missing, 'carry' needs it$"):
        props_of(pb.SynthesizeRequest(), CARRY)
    with pytest.raises(RequestError, match=r"^furniture: missing, 'sit' needs it$"):
        props_of(pb.SynthesizeRequest(), SIT)
    mesh = pb.Furniture(mesh=pb.Mesh(format="doc", data=b""))
    with pytest.raises(RequestError, match=r"'doc', must be one of obj, stl, ply, glb"):
        props_of(pb.SynthesizeRequest(furniture=mesh), SIT)

"""Furniture of a simulated scene stands where the request has it, and goes where it is told."""

import math

import pytest
import torch

from policy.errors import RequestError
from policy.objects import props_of
from rpc.v1 import policy_pb2 as pb
from tests.support.policy_cases import SIT, chair
from world.scene.batch import Scenes


def test_furniture_is_moved_by_its_spot() -> None:
    props = props_of(pb.SynthesizeRequest(furniture=chair(2.0, 1.0, 0.5)), SIT)
    scenes = Scenes([props.model], 0.35, 3.0)
    props.begin(scenes)
    point, facing = props.use_point()
    torch.testing.assert_close(props.target(scenes).point[:, :2], point)
    there, turned = torch.tensor([[-1.0, 3.0]]), torch.tensor([[math.cos(2.0), math.sin(2.0)]])
    props.shift(scenes, there, turned)
    moved, faces = props.use_point()
    torch.testing.assert_close(moved, there)
    torch.testing.assert_close(faces, turned)
    torch.testing.assert_close(props.target(scenes).facing, turned)
    assert not torch.equal(facing, faces)
    position, rotation = props.pose(scenes)
    assert scenes.physics()["mocap_pos"].reshape(-1)[:3].tolist() == pytest.approx(position)
    assert math.hypot(*rotation) == pytest.approx(1.0)


def test_a_mesh_of_an_unknown_format_is_refused() -> None:
    mesh = pb.Furniture(mesh=pb.Mesh(format="doc", data=b""))
    with pytest.raises(RequestError, match=r"'doc', must be one of obj, stl, ply, glb"):
        props_of(pb.SynthesizeRequest(furniture=mesh), SIT)

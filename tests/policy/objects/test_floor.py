"""A point of the floor in messages: the target's pose, and no shape."""

import numpy as np
import pytest
import torch

from policy.errors import RequestError
from policy.messages import requests
from policy.objects import adapter
from policy.objects.columns import POSE_WIDTH
from policy.service.poses import observations
from policy.synthesis.simulation import Simulation
from rpc.v1 import policy_pb2 as pb
from tests.support import policy_cases
from world import tasks
from world.character import features
from world.character.features import STATE
from world.objects.floor_bank import FloorBank
from world.scene.target import state

WALK = tasks.make("walk")


def point(x: float, y: float, yaw: float = 0.0) -> pb.Furniture:
    return pb.Furniture(position=[x, y, 0.0], rotation=[np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)])


def test_a_situation_gives_the_observation_of_training() -> None:
    message = pb.Situation(pose=policy_cases.pose(10.0, -3.0), furniture=point(11.0, -1.0, 0.7))
    data, rows = requests.poses([message], WALK)
    found = torch.frombuffer(bytearray(data), dtype=torch.float32).view(rows, POSE_WIDTH)
    qpos = torch.from_numpy(policy_cases.character.standing_qpos()).float()[None]
    body = features.body(qpos, torch.zeros(1, 34))
    facing = torch.tensor([[np.cos(0.7), np.sin(0.7)]], dtype=torch.float32)
    target = FloorBank.target(torch.tensor([[1.0, 2.0]]), facing)
    wanted = torch.cat((state(body, target), WALK.goal_features(body, target)), dim=1)
    torch.testing.assert_close(observations(found, WALK), wanted, atol=1e-5, rtol=0)
    assert wanted.shape == (1, STATE.width + WALK.goal.width)


def test_a_shape_and_a_missing_target_are_refused() -> None:
    with pytest.raises(RequestError, match="needs no furniture"):
        requests.pose(
            pb.Situation(pose=policy_cases.pose(), furniture=policy_cases.chair()), WALK, "here"
        )
    with pytest.raises(RequestError, match=r"here\.furniture: missing, 'walk' needs it"):
        requests.pose(pb.Situation(pose=policy_cases.pose()), WALK, "here")
    assert adapter(WALK).message == "furniture"


def test_a_simulation_follows_the_target() -> None:
    served = policy_cases.make(task="walk")
    move = pb.Move(at_s=0.05, position=[0.0, 3.0, 0.0], rotation=[1.0, 0.0, 0.0, 0.0])
    request = pb.SynthesizeRequest(
        task="walk", seconds=0.2, furniture=point(2.0, 0.0), moves=[move], to_the_end=True
    )
    frames = [r.frame for r in Simulation(request, served, 10.0).frames() if r.HasField("frame")]
    assert frames[0].error_m == pytest.approx(2.0, abs=1e-4)
    assert list(frames[0].object_position) == [2.0, 0.0, 0.0]
    assert list(frames[-1].object_position) == [0.0, 3.0, 0.0]
    assert 2.5 < frames[-1].error_m < 3.5

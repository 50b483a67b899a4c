"""Situations as rows: their columns, and the observations that training would have built."""

import numpy as np
import torch
from policy.service.situations import COLUMNS, SITUATION, observations, place_of

from policy.messages.requests import situation
from rpc.v1 import policy_pb2 as pb
from tests.support.policy_cases import SIT, WIDTH, chair, pose
from world import tasks


def test_columns_lie_side_by_side() -> None:
    assert COLUMNS["qpos"] == slice(0, 43) and COLUMNS["qvel"] == slice(43, 77)
    ends = [part.stop for part in COLUMNS.values()]
    assert [part.start for part in COLUMNS.values()] == [0, *ends[:-1]] and ends[-1] == SITUATION


def test_what_is_turned_together_is_observed_alike() -> None:
    """Character and chair, turned about the vertical and carried off: the same numbers."""
    rows = []
    for yaw in (0.0, 1.2, -2.9):
        ahead = 2.0 * np.array([np.cos(yaw), np.sin(yaw)])
        message = pb.Situation(
            pose=pose(5.0, 1.0, yaw), furniture=chair(*(ahead + np.array([5.0, 1.0])), yaw)
        )
        rows.append(situation(message, SIT, "s"))
    found = observations(torch.from_numpy(np.stack(rows)).float(), SIT)
    assert found.shape == (3, WIDTH)
    torch.testing.assert_close(found[1], found[0], atol=1e-4, rtol=0)
    torch.testing.assert_close(found[2], found[0], atol=1e-4, rtol=0)


def test_a_boxs_point_of_use_is_its_target() -> None:
    row = torch.zeros(1, SITUATION)
    row[:, COLUMNS["box_rotation"]] = torch.tensor([1.0, 0.0, 0.0, 0.0])
    row[:, COLUMNS["box_half"]] = torch.tensor([0.1, 0.2, 0.3])
    row[:, COLUMNS["box_target"]] = torch.tensor([4.0, 5.0, 0.6])
    place = place_of(row, tasks.make("carry"))
    assert place.box is not None and place.point[0].tolist() == [4.0, 5.0, 0.6000000238418579]
    torch.testing.assert_close(place.corners[0].amax(0), torch.tensor([0.1, 0.2, 0.3]))

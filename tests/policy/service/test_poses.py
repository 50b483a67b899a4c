"""The observations of raw poses are those that training would have built."""

import numpy as np
import torch

from policy.messages.requests import pose as row
from policy.service.poses import observations
from rpc.v1 import policy_pb2 as pb
from tests.support.policy_cases import SIT, WIDTH, chair, pose


def test_what_is_turned_together_is_observed_alike() -> None:
    """Character and chair, turned about the vertical and carried off: the same numbers."""
    rows = []
    for yaw in (0.0, 1.2, -2.9):
        ahead = 2.0 * np.array([np.cos(yaw), np.sin(yaw)])
        message = pb.Situation(
            pose=pose(5.0, 1.0, yaw), furniture=chair(*(ahead + np.array([5.0, 1.0])), yaw)
        )
        rows.append(row(message, SIT, "s"))
    found = observations(torch.from_numpy(np.stack(rows)).float(), SIT)
    assert found.shape == (3, WIDTH)
    torch.testing.assert_close(found[1], found[0], atol=1e-4, rtol=0)
    torch.testing.assert_close(found[2], found[0], atol=1e-4, rtol=0)

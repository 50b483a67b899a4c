"""Poses on the floor as tensors."""

import math

import torch

from console.kinds.poses import HERE, tensors
from console.kinds.setup import Pose


def test_a_pose_is_a_point_and_a_heading() -> None:
    point, heading = tensors(Pose(1.0, -2.0, math.pi / 3))
    assert point.tolist() == [[1.0, -2.0]]
    torch.testing.assert_close(heading, torch.tensor([[0.5, 0.75**0.5]]))
    assert HERE.tolist() == [0]

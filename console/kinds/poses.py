"""Poses on the floor as tensors of one scene."""

import math

import torch
from torch import Tensor

from console.kinds.setup import Pose

HERE = torch.zeros(1, dtype=torch.int64)


def tensors(pose: Pose) -> tuple[Tensor, Tensor]:
    """Return the floor point [1, 2] m and heading [1, 2] (cosine, sine) of a pose."""
    point = torch.tensor([[pose.x, pose.y]])
    return point, torch.tensor([[math.cos(pose.yaw), math.sin(pose.yaw)]])

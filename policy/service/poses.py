"""Observations of raw poses of a character and its object."""

import torch
from torch import Tensor

from policy.objects import adapter
from policy.objects.columns import COLUMNS
from world.character import features
from world.scene.target import state
from world.tasks import Task


@torch.inference_mode()
def observations(rows: Tensor, task: Task) -> Tensor:
    """Return (state, goal) [n, width] of pose rows [n, POSE_WIDTH], float32: world frame, SI units.

    They are computed by the same functions as in training.
    """
    body = features.body(rows[:, COLUMNS["qpos"]], rows[:, COLUMNS["qvel"]])
    target = adapter(task).target(rows)
    return torch.cat((state(body, target), task.goal_features(body, target)), dim=1)

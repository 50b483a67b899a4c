"""Raw poses of a character and its object as rows of numbers, and the observations they give."""

import torch
from torch import Tensor

from world import rotations
from world.character import features
from world.character import model as character
from world.tasks import Place, Task
from world.tasks.task import BoxState, state

_PARTS = (
    ("qpos", character.NQ),
    ("qvel", character.NV),
    ("point", 3),
    ("facing", 2),
    ("corners", 24),
    ("head", 3),
    ("box_position", 3),
    ("box_rotation", 4),
    ("box_velocity", 3),
    ("box_half", 3),
    ("box_start", 3),
    ("box_target", 3),
)


def _slices() -> tuple[dict[str, slice], int]:
    found, start = {}, 0
    for name, width in _PARTS:
        found[name] = slice(start, start + width)
        start += width
    return found, start


COLUMNS, POSE_WIDTH = _slices()
"""Columns of each part of a pose request in its row, and the width of a row."""


def place_of(rows: Tensor, task: Task) -> Place:
    """Return the object's place of pose rows [n, POSE_WIDTH]."""

    def part(name: str) -> Tensor:
        return rows[:, COLUMNS[name]]

    if task.affordance == "carry":
        names = ("position", "rotation", "velocity", "half", "start", "target")
        box = BoxState(*(part(f"box_{name}") for name in names))
        # as training has it: the point of use is the target
        facing = rotations.heading(box.rotation)
        return Place(box.target, facing, box.corners(), box.target, box)
    corners = part("corners").unflatten(1, (8, 3))
    return Place(part("point"), part("facing"), corners, part("head"))


@torch.inference_mode()
def observations(rows: Tensor, task: Task) -> Tensor:
    """Return (state, goal) [n, width] of pose rows [n, POSE_WIDTH], float32: world frame, SI units.

    The same functions build them as in training.
    """
    body = features.body(rows[:, COLUMNS["qpos"]], rows[:, COLUMNS["qvel"]])
    place = place_of(rows, task)
    return torch.cat((state(body, place), task.goal_features(body, place)), dim=1)

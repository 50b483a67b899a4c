"""The box of messages: what the carry task must know of it."""

import numpy as np
import torch

from policy.errors import RequestError
from policy.fields import FAST, Numbers, quaternion, upright, vector
from policy.service.poses import COLUMNS
from rpc.v1 import policy_pb2 as pb
from world.objects.box_bank import Layout, resting

#: Edges and weights of boxes, m and kg.
SIZES_M, MASSES_KG = (0.05, 2.0), (0.05, 100.0)


def size_of(box: pb.CarriedBox, name: str) -> Numbers:
    """Edge lengths [3], m."""
    size = vector(box.size, f"{name}.size", 3, SIZES_M[1])
    if not (size >= SIZES_M[0]).all():
        raise RequestError(f"{name}.size: must be {SIZES_M[0]:g} to {SIZES_M[1]:g} m each")
    return size


def fill_box(row: Numbers, box: pb.CarriedBox, name: str) -> None:
    """Write what the task must know of a box into a row: world frame."""
    row[COLUMNS["box_half"]] = 0.5 * size_of(box, name)
    row[COLUMNS["box_position"]] = vector(box.position, f"{name}.position", 3)
    row[COLUMNS["box_rotation"]] = quaternion(box.rotation, f"{name}.rotation")
    row[COLUMNS["box_velocity"]] = vector(box.velocity, f"{name}.velocity", 3, FAST)
    row[COLUMNS["box_start"]] = vector(box.start, f"{name}.start", 3)
    row[COLUMNS["box_target"]] = vector(box.goal, f"{name}.goal", 3)


def carried(box: pb.CarriedBox) -> tuple[Numbers, Layout]:
    """Size [3] m and layout of a box that rests upright on its stand; goal: where it should go."""
    size = size_of(box, "box")
    position = vector(box.position, "box.position", 3)
    yaw = upright(box.rotation, "box.rotation") if box.rotation else 0.0
    goal = vector(box.goal, "box.goal", 3)
    for name, height in (("position", position[2]), ("goal", goal[2])):
        if height < 0.5 * size[2]:
            raise RequestError(f"box.{name}[2]: {height:.3f}, must be above half the box's height")
    rows = (torch.from_numpy(point).float()[None] for point in (position, goal))
    where, target = rows
    turned = torch.tensor([[np.cos(yaw), np.sin(yaw)]], dtype=torch.float32)
    return size, resting(where, turned, target)

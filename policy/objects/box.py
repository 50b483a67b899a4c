"""Boxes in messages, for the carry task."""

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from policy.errors import RequestError
from policy.fields import FAST, Numbers, number, quaternion, upright, vector
from policy.objects.adapter import Cancelled, not_cancelled
from policy.objects.columns import COLUMNS
from rpc.v1 import policy_pb2 as pb
from world import rotations
from world.furniture.piece import Box, Piece
from world.objects.box_bank import BoxBank, Layout, resting
from world.scene import box as box_scene
from world.scene.batch import Scenes
from world.scene.model import Ball
from world.scene.target import BoxState, Target
from world.tasks import Task

_HERE = torch.zeros(1, dtype=torch.int64)
#: Bounds of a box's edge lengths, m, and mass, kg.
SIZES_M, MASSES_KG = (0.05, 2.0), (0.05, 100.0)


def size_of(box: pb.CarriedBox, name: str) -> Numbers:
    """Edge lengths [3], m; RequestError outside of SIZES_M."""
    size = vector(box.size, f"{name}.size", 3, SIZES_M[1])
    if not (size >= SIZES_M[0]).all():
        raise RequestError(f"{name}.size: must be {SIZES_M[0]:g} to {SIZES_M[1]:g} m each")
    return size


def fill_box(row: Numbers, box: pb.CarriedBox, name: str) -> None:
    """Write a box into a pose row, in the world frame."""
    row[COLUMNS["box_half"]] = 0.5 * size_of(box, name)
    row[COLUMNS["box_position"]] = vector(box.position, f"{name}.position", 3)
    row[COLUMNS["box_rotation"]] = quaternion(box.rotation, f"{name}.rotation")
    row[COLUMNS["box_velocity"]] = vector(box.velocity, f"{name}.velocity", 3, FAST)
    row[COLUMNS["box_start"]] = vector(box.start, f"{name}.start", 3)
    row[COLUMNS["box_target"]] = vector(box.goal, f"{name}.goal", 3)


def carried(box: pb.CarriedBox) -> tuple[Numbers, Layout]:
    """Edge lengths [3], m, and layout of a box that rests upright on its stand."""
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


class BoxAdapter:
    """See Adapter."""

    message = "box"

    def target(self, rows: Tensor) -> Target:
        """See Adapter."""
        names = ("position", "rotation", "velocity", "half", "start", "target")
        box = BoxState(*(rows[:, COLUMNS[f"box_{name}"]] for name in names))
        # as in training: the use point is the target of the box
        facing = rotations.heading(box.rotation)
        return Target(box.target, facing, box.corners(), box.target, box)

    def fill(self, row: Numbers, message: pb.Situation, task: Task, name: str) -> None:
        """See Adapter."""
        fill_box(row, message.box, f"{name}.box")

    def props(
        self,
        request: pb.SynthesizeRequest,
        task: Task,
        balls: Sequence[Ball],
        piece: Piece | None,
        cancelled: Cancelled = not_cancelled,
    ) -> "BoxArrangement":
        """See Adapter."""
        return BoxArrangement(request.box, balls)


class BoxArrangement:
    """A box on its stand, and the stand at its target."""

    def __init__(self, message: pb.CarriedBox, balls: Sequence[Ball] = ()) -> None:
        size, layout = carried(message)
        mass = None
        if message.HasField("mass_kg"):
            mass = number(message.mass_kg, "box.mass_kg", *MASSES_KG)
        else:
            mass = box_scene.BOX_KG * float(np.prod(size)) / float(np.prod(box_scene.BOX_SIZE_M))
        x, y, z = (0.5 * float(edge) for edge in size)
        piece = Piece("box", "box", (Box((0.0, 0.0, 0.0), (x, y, z)),), (), mass)
        self._bank, self._layout = BoxBank([piece], balls), layout
        self.model = self._bank.models[0]

    def begin(self, scenes: Scenes) -> None:
        """See Props."""
        self._bank.apply(scenes, _HERE, _HERE, self._layout)

    def target(self, scenes: Scenes) -> Target:
        """See Props."""
        return scenes.now(self._bank.target(_HERE, self._layout))

    def move(self, scenes: Scenes, position: Numbers, yaw: float) -> None:
        """Move the first stand, at its height, and the box if it rests on it."""
        turned = torch.tensor([[np.cos(yaw), np.sin(yaw)]], dtype=torch.float32)
        self.shift(scenes, torch.from_numpy(position[:2]).float()[None], turned)

    def use_point(self) -> tuple[Tensor, Tensor]:
        """See Props."""
        return self._layout.start[:, :2], self._layout.start_yaw

    def shift(self, scenes: Scenes, point: Tensor, facing: Tensor) -> None:
        """See Props."""
        self._layout = self._bank.shift(scenes, _HERE, _HERE, self._layout, point, facing)

    def pose(self, scenes: Scenes) -> tuple[list[float], list[float]]:
        """See Props."""
        pose: Tensor = scenes.free_qpos[0, :7]
        return pose[:3].tolist(), pose[3:].tolist()

    def boxes(self) -> tuple[Box, ...]:
        """See Props."""
        return self._bank.pieces[0].boxes

"""A target on the floor in the player, in recordings and in flags."""

import math
from collections.abc import Sequence

import torch

from console.commands import Synthesize
from console.kinds.flags import numbers
from console.kinds.poses import HERE, tensors
from console.kinds.setup import Pose, Setup
from console.recording.format import Take
from rpc.v1 import policy_pb2 as pb
from world import rotations
from world.config import CarryConfig
from world.furniture.piece import Piece
from world.objects.floor_bank import FloorBank
from world.scene.batch import Scenes
from world.scene.model import Ball
from world.scene.target import Target
from world.tasks import Task


class FloorKind:
    """The floor kind; see Kind."""

    pictured = False
    flags: frozenset[str] = frozenset()

    def played(
        self, setup: Setup, piece: Piece, task: Task, carry: CarryConfig, balls: Sequence[Ball]
    ) -> "PlayedPoint":
        """See Kind."""
        return PlayedPoint(setup, balls)

    def recorded(self, take: Take, task: Task) -> Target:
        """Return the target at the marker's pose."""
        point = torch.from_numpy(take.mocap_pos[:, :2]).float()
        facing = rotations.heading(torch.from_numpy(take.mocap_quat).float())
        return FloorBank.target(point, facing)

    def requested(
        self, command: Synthesize, task: Task, request: pb.SynthesizeRequest
    ) -> Piece | None:
        """See Kind."""
        x, y, yaw = numbers("--at", command.at, "X,Y,YAW (m, m, degrees)")
        half = 0.5 * math.radians(yaw)
        request.furniture.CopyFrom(
            pb.Furniture(position=[x, y, 0.0], rotation=[math.cos(half), 0.0, 0.0, math.sin(half)])
        )
        return None

    def shown(self, piece: Piece) -> Piece:
        """Return the marker."""
        return piece


class PlayedPoint:
    """A target on an empty floor; see Object."""

    def __init__(self, setup: Setup, balls: Sequence[Ball]) -> None:
        self._bank = FloorBank(balls)
        self.model = self._bank.models[0]
        self._goal = setup.goal

    def begin(self, scenes: Scenes) -> None:
        """See Object."""
        self.move(scenes, self._goal)

    def move(self, scenes: Scenes, goal: Pose) -> None:
        """See Object."""
        self._goal = goal
        scenes.move_furniture(HERE, *self._bank.placed(*tensors(goal)))

    def target(self, scenes: Scenes) -> Target:
        """See Object."""
        return self._bank.target(*tensors(self._goal))

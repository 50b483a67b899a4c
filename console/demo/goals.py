"""What the character is sent to: furniture to use, a box to carry, a point of the floor."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from console.kinds.poses import HERE, tensors
from console.kinds.setup import Pose
from world import rotations
from world.furniture.piece import Piece
from world.furniture.usage import use_points
from world.objects.box_bank import BoxBank, resting
from world.objects.floor_bank import FloorBank
from world.objects.furniture_bank import FurnitureBank
from world.scene.batch import Scenes
from world.scene.box import GROUND_M
from world.scene.target import Target

Points = NDArray[np.float64]
#: A standing character before furniture: the distance of its root from the edge, m.
_BEFORE_M = 0.4
#: Distance at which the policy of carry takes over from walking, m: its approach is its weakest
#: part, but it must still turn to the box.
_TO_BOX_M = 1.6


@dataclass
class Thing:
    """A piece in a room, and its pose; the pose changes."""

    name: str
    piece: Piece
    index: int
    """Of its mocap body."""
    pose: Pose
    """Of its origin."""
    wanted: Pose
    """Where it moves to."""
    up_m: float = 0.0
    """Height of its origin: of a stand, its top."""

    def origin(self) -> tuple[Tensor, Tensor]:
        """Origin [1, 3] m and yaw [1, 2] (cosine, sine)."""
        point, yaw = tensors(self.pose)
        return torch.cat((point, torch.tensor([[self.up_m]])), dim=1), yaw


class Goal(Protocol):
    """A goal of the character; it holds no state of the scene."""

    policy: str
    """Name of the policy that reaches it."""
    label: str
    """What the page calls it."""
    things: tuple[Thing, ...]
    """What the policy itself steers clear of."""
    surface_m: float
    """Height of what a character rests on that has reached it; 0: it stands on the floor."""
    carries: bool
    """Whether the scene steps as one with a box."""

    def target(self, scenes: Scenes) -> Target:
        """The present target of the task."""
        ...

    def entry(self) -> Points:
        """Floor point [2], m, to which the way must be free, and where a character that rests here
        is put on its feet."""
        ...

    def takes_over(self, root: Points) -> bool:
        """Whether the policy may take over, by distance, with the way free; root [2] m."""
        ...


class UseGoal:
    """Furniture to use, by one of its use points."""

    carries = False

    def __init__(self, policy: str, label: str, thing: Thing, affordance: str, side: int) -> None:
        self.policy, self.label, self.things = policy, label, (thing,)
        self._bank = FurnitureBank([thing.piece] * (side + 1), affordance)
        self._variant = torch.tensor([side])
        self.surface_m = float(self._bank.point[side, 2])

    def _placed(self) -> tuple[Tensor, Tensor]:
        """The use point on the floor [1, 2] m, and its facing [1, 2]."""
        origin, yaw = self.things[0].origin()
        point = origin[:, :2] + rotations.turn(yaw, self._bank.point[self._variant, :2])
        return point, rotations.turn(yaw, self._bank.facing[self._variant])

    def target(self, scenes: Scenes) -> Target:
        """See Goal."""
        return self._bank.target(self._variant, *self._placed())

    def entry(self) -> Points:
        """See Goal."""
        point, facing = self._placed()
        ahead = float(self._bank.high[self._variant, 0]) + _BEFORE_M
        return (point + ahead * facing)[0].double().numpy()

    def takes_over(self, root: Points) -> bool:
        """See Goal: the policies of furniture approach it from any side."""
        return True


class BoxGoal:
    """A box to carry to a stand."""

    surface_m, carries = 0.0, True

    def __init__(
        self, policy: str, name: str, box: Piece, index: int, stand: Thing, scenes: Scenes
    ) -> None:
        """The box begins where it is; `index` is that of its free body, `stand` its target."""
        self.policy, self.label, self.things = policy, f"{policy}: {name}", ()
        self.box_name = name
        self._index, self._stand = index, stand
        self._bank = BoxBank([box])
        pose = scenes.free_qpos[:, 7 * index : 7 * index + 7].float()
        self._start, self._yaw = pose[:, :3].clone(), rotations.heading(pose[:, 3:])

    def lost(self, scenes: Scenes) -> bool:
        """Whether the box lies on the floor."""
        return float(scenes.free_qpos[0, 7 * self._index + 2]) < GROUND_M

    def target(self, scenes: Scenes) -> Target:
        """See Goal."""
        top, _ = self._stand.origin()
        up = torch.tensor([[0.0, 0.0, float(self._bank.half[0, 2])]])
        layout = resting(self._start, self._yaw, top + up)
        return scenes.now(self._bank.target(HERE, layout), index=self._index)

    def entry(self) -> Points:
        """See Goal: the box itself."""
        return self._start[0, :2].double().numpy()

    def takes_over(self, root: Points) -> bool:
        """See Goal."""
        return float(np.linalg.norm(root - self.entry())) < _TO_BOX_M


class FloorGoal:
    """A point of the floor."""

    things: tuple[Thing, ...] = ()
    surface_m, carries = 0.0, False

    def __init__(self, policy: str, label: str, pose: Pose) -> None:
        self.policy, self.label, self.pose = policy, label, pose

    def target(self, scenes: Scenes) -> Target:
        """See Goal."""
        return FloorBank.target(*tensors(self.pose))

    def entry(self) -> Points:
        """See Goal."""
        return np.array([self.pose.x, self.pose.y])

    def takes_over(self, root: Points) -> bool:
        """See Goal."""
        return True


def sides(policy: str, label: str, thing: Thing, affordance: str) -> list[UseGoal]:
    """A goal for each use point of a piece."""
    count = len(use_points(thing.piece, affordance))
    return [UseGoal(policy, label, thing, affordance, side) for side in range(count)]


def nearest(goals: Sequence[UseGoal], root: Points) -> UseGoal:
    """The goal whose entry is nearest to a root [2], m."""
    return min(goals, key=lambda goal: math.dist(goal.entry(), root))

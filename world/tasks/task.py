"""What a task is: a goal, named weighted reward terms, success and termination, on tensors of
scenes."""

from dataclasses import dataclass
from typing import ClassVar, Protocol

import torch
from torch import Tensor

from world.features import Body, Table


@dataclass(frozen=True)
class Place:
    """Where the object stands in each of n scenes, world frame."""

    point: Tensor
    """[n, 3]: the point of use on the object's surface, m."""
    facing: Tensor
    """[n, 2]: cosine and sine of the direction that its user faces."""
    corners: Tensor
    """[n, 8, 3]: the corners of the object's bounding box, m."""

    def rows(self, ids: Tensor) -> "Place":
        """The scenes of the given indices."""
        return Place(self.point[ids], self.facing[ids], self.corners[ids])

    def floor_point(self) -> Tensor:
        """[n, 3]: the floor below the point of use: origin of the object's frame in the
        features."""
        return torch.cat((self.point[:, :2], torch.zeros_like(self.point[:, :1])), dim=1)


class Task(Protocol):
    """One thing to do with an object; all tensors are float32 over n scenes."""

    name: str
    goal: Table
    terms: ClassVar[dict[str, float]]
    """Reward terms by name, with their weights: the task's reward is the weighted sum."""

    def goal_features(self, body: Body, place: Place) -> Tensor:
        """[n, goal.width]: what the policy and the value function see of the goal."""
        ...

    def reward_terms(self, body: Body, place: Place) -> Tensor:
        """[n, len(terms)]: the terms, unweighted, each in [0, 1] or [-1, 0]."""
        ...

    def error_m(self, body: Body, place: Place) -> Tensor:
        """[n]: how far from done, m; success is being within `success_m`."""
        ...

    success_m: float

    def fell(self, body: Body, place: Place) -> Tensor:
        """[n] bool: the episode ends here as a failure."""
        ...

"""Targets of tasks: an object's use point with its facing, or a box with its own target; and the
114 state features of a character with its object."""

from dataclasses import dataclass

import torch
from torch import Tensor

from world import rotations
from world.character import features
from world.character.features import Body
from world.device import at

_SIGNS = torch.tensor([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]).float()


@dataclass(frozen=True)
class BoxState:
    """The free boxes of n scenes with their targets, world frame."""

    position: Tensor
    """[n, 3]: centre, m."""
    rotation: Tensor
    """[n, 4]: unit quaternion w, x, y, z."""
    velocity: Tensor
    """[n, 3]: of the centre, m/s."""
    half: Tensor
    """[n, 3]: half edge lengths along its own axes, m."""
    start: Tensor
    """[n, 3]: initial position of the centre, or its position on the initial stand, m."""
    target: Tensor
    """[n, 3]: target of the centre, m."""

    def corners(self) -> Tensor:
        """[n, 8, 3]: corners, m; x changes slowest, z fastest, low first."""
        local = self.half[:, None] * at(_SIGNS, self.half)
        axes = rotations.matrix(self.rotation)
        return self.position[:, None] + (axes[:, None] @ local[..., None])[..., 0]

    def rows(self, ids: Tensor) -> "BoxState":
        """The scenes of the given indices."""
        return BoxState(
            self.position[ids],
            self.rotation[ids],
            self.velocity[ids],
            self.half[ids],
            self.start[ids],
            self.target[ids],
        )


@dataclass(frozen=True)
class Target:
    """Targets of n scenes, world frame."""

    point: Tensor
    """[n, 3]: the use point on the object's surface, m."""
    facing: Tensor
    """[n, 2]: cosine and sine of the facing of the seated character; for lying, of the access
    side."""
    corners: Tensor
    """[n, 8, 3]: the corners of the object's bounding box, m; of furniture in the order of the use
    point, +x along its facing, x slowest, z fastest, low first. The front corners of furniture that
    reaches further forward on one side are those of each side (UsePoint.corners)."""
    head: Tensor | None = None
    """[n, 3]: the point on the surface below the head of a lying character, m."""
    box: BoxState | None = None
    """The boxes to carry; None in other tasks."""

    def rows(self, ids: Tensor) -> "Target":
        """The scenes of the given indices."""
        return Target(
            self.point[ids],
            self.facing[ids],
            self.corners[ids],
            None if self.head is None else self.head[ids],
            None if self.box is None else self.box.rows(ids),
        )

    def tensors(self) -> dict[str, Tensor]:
        """The tensors that are constant in an episode, by name, without copies."""
        found = {"point": self.point, "facing": self.facing, "corners": self.corners}
        if self.head is not None:
            found["head"] = self.head
        if self.box is not None:
            box = self.box
            found |= {"box_half": box.half, "box_start": box.start, "box_target": box.target}
        return found

    def write(self, ids: Tensor, part: "Target") -> None:
        """Overwrite the scenes `ids` [m] with those of `part` [m]."""
        theirs = part.tensors()
        for name, value in self.tensors().items():
            value[ids] = theirs[name]

    def set_points(self) -> Tensor | None:
        """[n, 28] rad: set-points that actions are added to; None: the neutral ones."""
        return None

    def advance(self, body: Body) -> None:
        """Advance what changes during an episode by one control step, which ended in `body`."""

    def completed(self) -> Tensor | None:
        """[n] bool: the reference motion has ended, which truncates the episode; None: success
        held does."""
        return None

    def episode_records(self) -> dict[str, Tensor]:
        """What an episode records at its end besides the statistics of every task, by name, [n]
        each."""
        return {}

    def object_features(self, body: Body) -> Tensor:
        """[n, 9]: the state's features of the object: its furniture, or its box."""
        if self.box is None:
            return features.object_features(
                body.root, body.heading, self.floor_point(), self.facing
            )
        return features.posed_object_features(
            body.root, body.heading, self.box.position, self.box.rotation
        )

    def floor_point(self) -> Tensor:
        """[n, 3]: the floor below the use point, m: origin of the object's frame in the
        features."""
        return torch.cat((self.point[:, :2], torch.zeros_like(self.point[:, :1])), dim=1)


def state(body: Body, target: Target) -> Tensor:
    """State features [n, 114] of the character and its object."""
    return torch.cat((body.features, target.object_features(body)), dim=1)

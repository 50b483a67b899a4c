"""Where a task leads: the object's point of use and its facing, or the box and its goal; and the
114 features of a character with it."""

from dataclasses import dataclass

import torch
from torch import Tensor

from world import rotations
from world.character import features
from world.character.features import Body

_SIGNS = torch.tensor([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]).float()


@dataclass(frozen=True)
class BoxState:
    """The free box of each of n scenes and where it should go, world frame."""

    position: Tensor
    """[n, 3]: its centre, m."""
    rotation: Tensor
    """[n, 4]: unit quaternion w, x, y, z."""
    velocity: Tensor
    """[n, 3]: of its centre, m/s."""
    half: Tensor
    """[n, 3]: half edge lengths along its own axes, m."""
    start: Tensor
    """[n, 3]: where its centre was when the episode started, or would be on the stand, m."""
    target: Tensor
    """[n, 3]: where its centre should be put, m."""

    def corners(self) -> Tensor:
        """[n, 8, 3]: its corners, m; x changes slowest, z fastest, low first."""
        local = self.half[:, None] * _SIGNS
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
    """What a task must know of the object in each of n scenes, world frame."""

    point: Tensor
    """[n, 3]: the point of use on the object's surface, m."""
    facing: Tensor
    """[n, 2]: cosine and sine of the direction that its user faces; of the side to get on by where
    it is lain on."""
    corners: Tensor
    """[n, 8, 3]: the corners of the object's bounding box, m; of furniture in the order of the
    place, +x where it faces, x slowest, z fastest, low first."""
    head: Tensor | None = None
    """[n, 3]: the point on the surface below the head of one who lies there, m."""
    box: BoxState | None = None
    """The box to be carried."""

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
        """What of it lasts an episode, by name; the tensors themselves."""
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

    def floor_point(self) -> Tensor:
        """[n, 3]: the floor below the point of use: origin of the object's frame in the
        features."""
        return torch.cat((self.point[:, :2], torch.zeros_like(self.point[:, :1])), dim=1)


def state(body: Body, target: Target) -> Tensor:
    """The 114 features [n, 114] of the character and its object: the furniture that it uses, or
    the box that it carries."""
    if target.box is None:
        return features.state(body, target.floor_point(), target.facing)
    around = features.posed_object_features(
        body.root, body.heading, target.box.position, target.box.rotation
    )
    return torch.cat((body.features, around), dim=1)

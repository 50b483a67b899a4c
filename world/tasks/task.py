"""What a task is: a goal, named weighted reward terms, success, stages and termination, on tensors
of scenes."""

from dataclasses import dataclass
from typing import ClassVar, Literal, Protocol

import torch
from torch import Tensor

from world import rotations
from world.character import features
from world.character.features import Body, Table

Affordance = Literal["sit", "lie", "carry"]
"""What an object offers: a seat, a lying place, or itself to be carried."""

#: Name of the last stage of every task: success held. Whoever runs the episodes knows it, since
#: `stage` sees a moment alone.
HELD = "held"


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
class Place:
    """Where the object stands in each of n scenes, world frame."""

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

    def rows(self, ids: Tensor) -> "Place":
        """The scenes of the given indices."""
        return Place(
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

    def write(self, ids: Tensor, part: "Place") -> None:
        """Overwrite the scenes `ids` [m] with those of `part` [m]."""
        theirs = part.tensors()
        for name, value in self.tensors().items():
            value[ids] = theirs[name]

    def setpoints(self) -> Tensor | None:
        """[n, 28] rad: what actions are added to; None: the mean pose."""
        return None

    def advance(self, body: Body) -> None:
        """After a control step: what lasts an episode moves on with `body`."""

    def told(self) -> dict[str, Tensor]:
        """What an episode tells at its end besides, by name, [n] each."""
        return {}

    def over(self) -> Tensor | None:
        """[n] bool: whether what is followed is at its end; None: nothing is."""
        return None

    def object_features(self, body: Body) -> Tensor:
        """[n, 9]: the object's position and rotation in the state."""
        if self.box is None:
            return features.object_features(
                body.root, body.heading, self.floor_point(), self.facing
            )
        return features.posed_object_features(
            body.root, body.heading, self.box.position, self.box.rotation
        )

    def floor_point(self) -> Tensor:
        """[n, 3]: the floor below the point of use: origin of the object's frame in the
        features."""
        return torch.cat((self.point[:, :2], torch.zeros_like(self.point[:, :1])), dim=1)


def state(body: Body, place: Place) -> Tensor:
    """The 114 features [n, 114] of the character and its object: the furniture that it uses, or
    the box that it carries."""
    return torch.cat((body.features, place.object_features(body)), dim=1)


class Task(Protocol):
    """One thing to do with an object; all tensors are float32 over n scenes."""

    name: str
    affordance: Affordance
    """What the object must offer."""
    episode_s: float
    """Length of a training episode, s."""
    goal: Table
    alike: ClassVar[dict[str, str]]
    """Goal features that mean to a policy what another name means in other tasks: by these, and by
    equal names, one task's networks begin as another's."""
    sides: ClassVar[tuple[str, str] | None]
    """Two goal features whose first numbers are directions on the floor: where the second points to
    the right of the first, the networks see the scene mirrored, and so know one side alone. Both
    must last an episode, but for the heading they are seen from. None: nothing is mirrored."""
    terms: ClassVar[dict[str, float]]
    """Reward terms by name, with their weights: the task's reward is the weighted sum."""
    stages: ClassVar[tuple[str, ...]]
    """What leads to success, in order; an episode has reached a stage that was true once. After
    them comes HELD."""

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

    def stage(self, body: Body, place: Place) -> Tensor:
        """[n, len(stages)] bool: which stages hold at this moment."""
        ...

    def low(self, body: Body, place: Place) -> Tensor:
        """[n] bool: where the task takes the pelvis down; elsewhere a low pelvis ends a training
        episode early."""
        ...

    def fell(self, body: Body, place: Place) -> Tensor:
        """[n] bool: the episode ends here as a failure."""
        ...

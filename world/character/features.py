"""The named feature tables of policy and discriminator: the state (114), and each task's goal.

One function computes the state for simulation, mocap and serving. All but the root's height and
rotation is in the heading frame: origin at the root, x along the root's heading, z up
(paper, section 4).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import torch
from torch import Tensor

from world import rotations
from world.character import kinematics, soles
from world.character import model as character
from world.device import at


@dataclass(frozen=True)
class Feature:
    """One named stretch of a feature vector."""

    name: str
    width: int
    frame: str
    unit: str
    formula: str = ""
    """A numpy expression over the quantities of world.character.formulas. The reference page prints
    it, and a test compares it with the package's features."""
    meaning: str = ""
    """What the feature is, where no such expression gives it, as it needs a reference motion. The
    reference page prints it in place of a formula."""


class Table:
    """An ordered list of features, sliced by name."""

    def __init__(self, name: str, *features: Feature) -> None:
        self.name = name
        self.features = features
        self._slices: dict[str, slice] = {}
        start = 0
        for feature in features:
            self._slices[feature.name] = slice(start, start + feature.width)
            start += feature.width
        self.width = start

    def slice(self, name: str) -> slice:
        """The slice of the feature `name`; KeyError for an unknown name."""
        return self._slices[name]

    def __iter__(self) -> Iterator[Feature]:
        return iter(self.features)

    def layout(self) -> list[list[str | int]]:
        """[[name, width], ...], which a checkpoint records and compares."""
        return [[f.name, f.width] for f in self.features]


_HEADING = "root heading"
_BALLS = tuple(j.name for j in character.JOINTS if j.is_ball)
_HINGES = tuple(j.name for j in character.JOINTS if not j.is_ball)
#: Bodies whose positions are features, in the paper's order.
KEY_BODIES = ("right_hand", "left_hand", "right_foot", "left_foot")
_KEY_IDS = [character.BODIES.index(b) for b in KEY_BODIES]

STATE = Table(
    "state",
    Feature("root_height", 1, "world", "m", "p[2]"),
    Feature("root_rotation", 6, _HEADING, "x and z axes", "six(H @ R)"),
    Feature("root_linear_velocity", 3, _HEADING, "m/s", "H @ v"),
    Feature("root_angular_velocity", 3, _HEADING, "rad/s", "H @ R @ w"),
    *(
        Feature(f"rotation_{name}", 6, "parent body", "x and z axes", f"six(matrix(Q_{name}))")
        for name in _BALLS
    ),
    *(Feature(f"angle_{name}", 1, "parent body", "rad", f"a_{name}") for name in _HINGES),
    Feature(
        "joint_velocity",
        28,
        "joint",
        "rad/s",
        f"np.hstack([{', '.join(f'w_{joint.name}' for joint in character.JOINTS)}])",
    ),
    *(Feature(f"position_{name}", 3, _HEADING, "m", f"H @ (P_{name} - p)") for name in KEY_BODIES),
    Feature("object_position", 3, _HEADING, "m", "H @ (o - p)"),
    Feature("object_rotation", 6, _HEADING, "x and z axes", "six(H @ O)"),
)
assert STATE.width == 114, STATE.width

#: Number of the leading features that describe the character alone.
BODY_WIDTH = STATE.slice("object_position").start
#: Features of the object, which an ablation hides from the discriminator.
OBJECT = slice(BODY_WIDTH, STATE.width)

_BALL_BODIES = [
    body
    for body, joint in zip(character.JOINT_BODIES, character.JOINTS, strict=True)
    if joint.is_ball
]
_HINGE_Q = torch.tensor(character.HINGE_QPOS)
#: The head's sphere: its body, and the height of its centre above the neck joint, m (humanoid.xml).
_HEAD, _HEAD_UP_M = character.BODIES.index("head"), 0.175


@dataclass(frozen=True)
class Body:
    """Features and poses of n characters."""

    features: Tensor
    """[n, 105]: the state without the object."""
    heading: Tensor
    """[n, 2]: cosine and sine of the root's heading."""
    position: Tensor
    """[n, 15, 3]: body positions, world, m."""
    root_velocity: Tensor
    """[n, 3]: the root's linear velocity, world, m/s."""
    angular_velocity: Tensor
    """[n, 3]: the root's angular velocity, world axes, rad/s."""
    head: Tensor
    """[n, 3]: centre of the head, world, m."""
    feet: Tensor
    """[n, 2, 3, 3]: rotation matrices of the feet, right first, world."""

    @property
    def root(self) -> Tensor:
        """[n, 3]: the root's position, world, m."""
        return self.position[:, 0]

    @property
    def soles(self) -> Tensor:
        """[n, 2, 4, 3]: corners of the soles, right foot first, world, m."""
        return soles.corners(self.position[:, soles.FEET], self.feet)


def body(qpos: Tensor, qvel: Tensor) -> Body:
    """The character's features from generalised coordinates qpos [n, 43] and velocities qvel [n,
    34].

    qvel is MuJoCo's: the free joint's linear velocity in world axes, its angular velocity in the
    root's own, ball joints' in the child's own axes. Float32 in, float32 out.
    """
    n = qpos.shape[0]
    heading = rotations.heading(qpos[:, 3:7])
    local = rotations.matrix(kinematics.local_rotations(qpos))
    position, rotation = kinematics.forward(qpos[:, :3], local)
    root = local[:, 0]
    angular = (root @ qvel[:, 3:6, None])[..., 0]
    key = position[:, _KEY_IDS] - position[:, :1]
    # the root's x and z axes, both velocities and the key bodies are turned in one operation
    world = torch.cat((root[:, None, :, 0], root[:, None, :, 2], qvel[:, None, 0:3]), dim=1)
    world = torch.cat((world, angular[:, None], key), dim=1)
    local_frame = rotations.turn_back(heading[:, None], world)
    balls = local[:, _BALL_BODIES][..., [0, 2]].transpose(2, 3)
    features = torch.cat(
        (
            qpos[:, 2:3],
            local_frame[:, :4].reshape(n, 12),
            balls.reshape(n, -1),
            qpos[:, at(_HINGE_Q, qpos)],
            qvel[:, 6:],
            local_frame[:, 4:].reshape(n, 12),
        ),
        dim=1,
    )
    head = position[:, _HEAD] + _HEAD_UP_M * rotation[:, _HEAD, :, 2]
    feet = rotation[:, soles.FEET]
    return Body(features, heading, position, qvel[:, :3], angular, head, feet)


def object_features(root: Tensor, heading: Tensor, position: Tensor, facing: Tensor) -> Tensor:
    """The nine object features of upright objects, [n, 9].

    Args: root [n, 3] and heading [n, 2] of the character; position [n, 3] of the object's frame,
    world, m; facing [n, 2], cosine and sine of its yaw.
    """
    offset = rotations.turn_back(heading, position - root)
    axis = rotations.turn_back(heading, facing)
    zero, one = torch.zeros_like(axis[:, :1]), torch.ones_like(axis[:, :1])
    return torch.cat((offset, axis, zero, zero, zero, one), dim=1)


def posed_object_features(
    root: Tensor, heading: Tensor, position: Tensor, rotation: Tensor
) -> Tensor:
    """The nine object features of objects that may be tilted, [n, 9].

    Args: root [n, 3] and heading [n, 2] of the character; position [n, 3] of the object's centre,
    world, m; rotation [n, 4], unit quaternion w, x, y, z.
    """
    axes = rotations.matrix(rotation)
    world = torch.stack((position - root, axes[..., 0], axes[..., 2]), dim=1)
    return rotations.turn_back(heading[:, None], world).flatten(1)


def state(own: Body, object_position: Tensor, object_facing: Tensor) -> Tensor:
    """State features [n, 114]: those of the character, then those of its object."""
    around = object_features(own.root, own.heading, object_position, object_facing)
    return torch.cat((own.features, around), dim=1)

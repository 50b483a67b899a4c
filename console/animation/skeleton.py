"""Motions as skeletons of files: joints with offsets, rotations over time, and a moving root."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from world.character import kinematics, soles
from world.character import model as character
from world.motions.clip import Clip
from world.motions.formats.recording import forward

Array = NDArray[np.float64]
Rest = Literal["hanging", "t-pose"]

#: Our x (forward), y (left), z (up) are z, x, y of files with y up: BVH and glTF.
Y_UP: Array = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
ROOT = "root"
"""Name of the joint on the floor that carries the root motion."""
#: End sites of bodies without children, in the body's frame, m: the crown, the hand's sphere, the
#: front of the sole.
ENDS_M = {
    "head": (0.0, 0.0, 0.27),
    "right_hand": (0.0, 0.0, -0.04),
    "left_hand": (0.0, 0.0, -0.04),
    "right_foot": soles.FRONT_M,
    "left_foot": soles.FRONT_M,
}
#: Least length of the sum of two unit vectors that still gives a heading.
_HEADS = 0.05


@dataclass(frozen=True)
class Skeleton:
    """T frames of J joints, parents before their children, in the axes and the unit of a file."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    """Each joint's parent, -1 for the root."""
    offsets: Array
    """[J, 3]: each joint's origin in its parent's axes at rest; the root's in the world."""
    local: Array
    """[T, J, 3, 3]: each joint's rotation in its parent's axes, the root's in the world."""
    moves: dict[int, Array]
    """Origins [T, 3] over time of the joints that are displaced, in place of their offsets."""
    fps: float
    ends: dict[int, Array] = field(default_factory=dict)
    """Ends [3] of joints without children, in their axes."""
    orders: dict[int, str] = field(default_factory=dict)
    """Order of the three rotations of a BVH joint, where it is not that of `bvh`."""

    @property
    def frames(self) -> int:
        return len(self.local)

    @cached_property
    def world(self) -> tuple[Array, Array]:
        """Positions [T, J, 3] and rotations [T, J, 3, 3] of the joints in the world."""
        offsets = np.tile(self.offsets, (self.frames, 1, 1))
        for joint, at in self.moves.items():
            offsets[:, joint] = at
        return forward(self.parents, offsets, self.local, offsets[:, 0])

    def turned(self, axes: Array) -> "Skeleton":
        """The skeleton in other axes: a vector v becomes axes @ v, for joints as for the world."""
        return replace(
            self,
            offsets=self.offsets @ axes.T,
            local=axes @ self.local @ axes.T,
            moves={joint: at @ axes.T for joint, at in self.moves.items()},
            ends={joint: axes @ end for joint, end in self.ends.items()},
        )

    def scaled(self, factor: float) -> "Skeleton":
        """The skeleton in another unit of length."""
        return replace(
            self,
            offsets=factor * self.offsets,
            moves={joint: factor * at for joint, at in self.moves.items()},
            ends={joint: factor * end for joint, end in self.ends.items()},
        )


def spread(body: str, arm_deg: float = 90.0, leg_deg: float = 0.0) -> Array:
    """Rotation [3, 3] of a body from the character's rest, with arms hanging, to one with the arms
    raised sideways by `arm_deg` and the legs by `leg_deg`: 90 and 0 are a T-pose."""
    side = -1.0 if body.startswith("right_") else 1.0
    part = body.removeprefix("right_").removeprefix("left_")
    angle = {"upper_arm": arm_deg, "lower_arm": arm_deg, "hand": arm_deg}.get(part, 0.0)
    if part in ("thigh", "shin"):
        angle = leg_deg
    return Rotation.from_euler("x", side * angle, degrees=True).as_matrix()


def of_clip(clip: Clip, rest: Rest = "hanging", root_motion: bool = False) -> Skeleton:
    """Return a clip as a skeleton in our axes (x forward, y left, z up), m.

    rest: the pose of the character where all rotations are 0. root_motion: see `with_root_motion`.
    """
    quaternion = clip.local_rotation.astype(np.float64).reshape(-1, 4)
    local = Rotation.from_quat(quaternion, scalar_first=True).as_matrix()
    local = local.reshape(clip.frames, len(character.BODIES), 3, 3)
    offsets = kinematics.offsets().double().numpy().copy()
    ends = {character.BODIES.index(body): np.array(end) for body, end in ENDS_M.items()}
    turns = np.stack([spread(body) if rest == "t-pose" else np.eye(3) for body in character.BODIES])
    for body, parent in enumerate(character.PARENTS):
        # each body gets the axes that it has in the world at rest
        above = turns[parent] if parent >= 0 else np.eye(3)
        local[:, body] = above @ local[:, body] @ turns[body].T
        offsets[body] = above @ offsets[body]
    found = Skeleton(
        names=character.BODIES,
        parents=character.PARENTS,
        offsets=offsets,
        local=local,
        moves={0: clip.root_position_m.astype(np.float64)},
        fps=clip.fps,
        ends={body: turns[body] @ end for body, end in ends.items()},
    )
    return with_root_motion(found) if root_motion else found


def heading(rotation: Array) -> Array:
    """Yaw [T] rad, without jumps, of pelvis rotations [T, 3, 3] in our axes.

    It is that of the horizontal sum of the forward axis and of the direction to the right of the
    left axis: one of both is horizontal also where the character lies. A frame with neither keeps
    the yaw before it.
    """
    ahead, left = rotation[:, :2, 0], rotation[:, :2, 1]
    sum_of_both = ahead + np.stack((left[:, 1], -left[:, 0]), axis=1)
    known = np.linalg.norm(sum_of_both, axis=1) > _HEADS
    yaw = np.arctan2(sum_of_both[:, 1], sum_of_both[:, 0])
    if not known.any():
        return np.zeros(len(yaw))
    last = np.maximum.accumulate(np.where(known, np.arange(len(yaw)), -1))
    last[last < 0] = int(np.argmax(known))
    return np.unwrap(yaw[last])


def with_root_motion(skeleton: Skeleton) -> Skeleton:
    """Return the same motion with a further joint above the root: on the floor below it, turned
    about the vertical by its heading. `skeleton` is in our axes."""
    position, rotation = skeleton.moves[0], skeleton.local[:, 0]
    yaw = heading(rotation)
    turn = Rotation.from_euler("z", yaw[:, None]).as_matrix()
    ground = position * np.array([1.0, 1.0, 0.0])
    back = np.swapaxes(turn, -1, -2)
    local = np.concatenate((turn[:, None], skeleton.local), axis=1)
    local[:, 1] = back @ rotation
    above = np.einsum("tij,tj->ti", back, position - ground)
    shifted = {joint + 1: at for joint, at in skeleton.moves.items() if joint}
    return Skeleton(
        names=(ROOT, *skeleton.names),
        parents=(-1, *(parent + 1 for parent in skeleton.parents)),
        offsets=np.concatenate((np.zeros((1, 3)), skeleton.offsets)),
        local=local,
        moves={0: ground, 1: above, **shifted},
        fps=skeleton.fps,
        ends={joint + 1: end for joint, end in skeleton.ends.items()},
        orders={joint + 1: order for joint, order in skeleton.orders.items()},
    )

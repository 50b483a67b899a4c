"""Motions of `Synthesize` as arrays."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inhabit_client.v1 import policy_pb2 as pb

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Frame:
    """One frame of a motion as it is computed."""

    message: pb.Frame
    """Everything that the service says of the frame: rewards, success, balls."""
    root_position: Array
    """[3] m."""
    root_rotation: Array
    """[4] w, x, y, z."""
    local_rotation: Array
    """[B, 4] w, x, y, z: each body's rotation in its parent's frame, the root's in the world."""
    object_position: Array
    """[3] m of the furniture or box; [0] without one."""
    object_rotation: Array
    """[4] w, x, y, z; [0] without one."""

    @property
    def time_s(self) -> float:
        return self.message.time_s


@dataclass(frozen=True)
class Motion:
    """A whole motion of T frames of B bodies."""

    header: pb.SynthesisHeader
    summary: pb.SynthesisSummary
    frames: tuple[Frame, ...]

    @property
    def fps(self) -> float:
        return self.header.control_hz

    @property
    def success(self) -> bool:
        return self.summary.success

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the bodies."""
        return tuple(body.name for body in self.header.bodies)

    @property
    def parents(self) -> tuple[int, ...]:
        """Each body's parent, -1 for the root."""
        return tuple(body.parent for body in self.header.bodies)

    @property
    def offsets(self) -> Array:
        """[B, 3] m: each body's origin in its parent's frame."""
        return np.array([list(body.offset) for body in self.header.bodies])

    @property
    def times_s(self) -> Array:
        """[T]."""
        return np.array([frame.time_s for frame in self.frames])

    @property
    def root_position(self) -> Array:
        """[T, 3] m."""
        return np.array([frame.root_position for frame in self.frames]).reshape(-1, 3)

    @property
    def local_rotation(self) -> Array:
        """[T, B, 4] w, x, y, z: in the parent's frame, the root's in the world."""
        count = len(self.header.bodies)
        return np.array([frame.local_rotation for frame in self.frames]).reshape(-1, count, 4)

    @property
    def object_position(self) -> Array:
        """[T, 3] m of the furniture or box."""
        return np.array([frame.object_position for frame in self.frames])

    @property
    def object_rotation(self) -> Array:
        """[T, 4] w, x, y, z."""
        return np.array([frame.object_rotation for frame in self.frames])

    def bodies(self) -> tuple[Array, Array]:
        """Return positions [T, B, 3] m and rotations [T, B, 4] (w, x, y, z) of the bodies in the
        world, by forward kinematics."""
        local, offsets = self.local_rotation, self.offsets
        position, rotation = np.empty((*local.shape[:2], 3)), np.empty_like(local)
        for body, parent in enumerate(self.parents):
            if parent < 0:
                position[:, body], rotation[:, body] = self.root_position, local[:, body]
                continue
            rotation[:, body] = product(rotation[:, parent], local[:, body])
            position[:, body] = position[:, parent] + turned(rotation[:, parent], offsets[body])
        return position, rotation


def frame_of(message: pb.Frame, header: pb.SynthesisHeader) -> Frame:
    """Return a frame of its message. Raises ValueError where it does not fit the header."""
    root = np.array(message.root_rotation)
    return Frame(
        message,
        np.array(message.root_position),
        root,
        local_rotations(root, np.array(message.joint_position), header.bodies, header.joints),
        np.array(message.object_position),
        np.array(message.object_rotation),
    )


def local_rotations(
    root: Array, joint_position: Array, bodies: Sequence[pb.Body], joints: Sequence[pb.Joint]
) -> Array:
    """Return rotations [B, 4] of the bodies in their parents, of positions of the joints: four
    numbers for a ball, one angle for a hinge. Raises ValueError for another count of numbers."""
    widths = [4 if joint.kind == "ball" else 1 for joint in joints]
    if len(joint_position) != sum(widths) or root.shape != (4,):
        raise ValueError(f"{len(joint_position)} positions of joints, not {sum(widths)}")
    names = [body.name for body in bodies]
    found = np.tile(np.array([1.0, 0.0, 0.0, 0.0]), (len(names), 1))
    found[[body.parent for body in bodies].index(-1)] = root
    at = 0
    for joint, width in zip(joints, widths, strict=True):
        own, half = joint_position[at : at + width], 0.5 * joint_position[at]
        if width == 1:
            own = np.array([np.cos(half), *(np.sin(half) * np.array(joint.axis))])
        found[names.index(joint.body)], at = own, at + width
    return found


def product(a: Array, b: Array) -> Array:
    """Return the product [..., 4] of quaternions w, x, y, z: first b, then a."""
    w, v, x, u = a[..., :1], a[..., 1:], b[..., :1], b[..., 1:]
    real = w * x - np.sum(v * u, axis=-1, keepdims=True)
    return np.concatenate((real, w * u + x * v + np.cross(v, u)), axis=-1)


def turned(rotation: Array, vector: Array) -> Array:
    """Return vectors [..., 3] turned by quaternions [..., 4]."""
    cross = np.cross(rotation[..., 1:], vector)
    return vector + 2.0 * (rotation[..., :1] * cross + np.cross(rotation[..., 1:], cross))

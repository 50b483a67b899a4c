"""Messages of scenes from plain numbers and arrays."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from inhabit_client.v1 import policy_pb2 as pb

#: Mesh formats of the service by suffix.
MESHES = ("obj", "stl", "ply", "glb")


def furniture(
    piece: str | Path | pb.Shape,
    at: Sequence[float] = (0.0, 0.0, 0.0),
    scale: float = 1.0,
    place: int = 0,
) -> pb.Furniture:
    """Return a piece of furniture.

    piece: a name of the service's catalogue, such as chair-test-000; a Path to a mesh (.obj, .stl,
    .ply, .glb), which the service decomposes; or a Shape. at: x, y (m) and yaw (rad) of its frame,
    whose front is +x. place: index of the use point. Raises ValueError for another format of mesh,
    OSError for a file that cannot be read.
    """
    x, y, yaw = at
    found = pb.Furniture(position=[x, y, 0.0], rotation=_turn(yaw), scale=scale, place=place)
    if isinstance(piece, Path):
        kind = piece.suffix.lower().removeprefix(".")
        if kind not in MESHES:
            raise ValueError(f"{piece}: no mesh of {', '.join(f'.{mesh}' for mesh in MESHES)}")
        found.mesh.CopyFrom(pb.Mesh(format=kind, data=piece.read_bytes()))
    elif isinstance(piece, str):
        found.piece = piece
    else:
        found.custom.CopyFrom(piece)
    return found


def box(
    position: Sequence[float],
    goal: Sequence[float],
    size: Sequence[float] = (0.35, 0.5, 0.3),
    yaw: float = 0.0,
    mass_kg: float | None = None,
) -> pb.CarriedBox:
    """Return the box to carry, at rest on its stand: the place of its centre, the target of its
    centre, and its edges, m."""
    return pb.CarriedBox(
        position=position, rotation=_turn(yaw), velocity=[0.0, 0.0, 0.0], size=size,
        start=position, goal=goal, mass_kg=mass_kg,
    )  # fmt: skip


def pose(
    root_position: ArrayLike,
    root_rotation: ArrayLike,
    joint_position: ArrayLike,
    root_velocity: ArrayLike = (0.0, 0.0, 0.0),
    root_angular_velocity: ArrayLike = (0.0, 0.0, 0.0),
    joint_velocity: ArrayLike | None = None,
) -> pb.Pose:
    """Return the pose of a character: positions [3], [4], [36] and velocities [3], [3], [28] in
    world axes, joints in the order of `Client.joints`; velocities are 0 by default."""
    still = np.zeros(28) if joint_velocity is None else joint_velocity
    return pb.Pose(
        root_position=_numbers(root_position, 3, "root_position"),
        root_rotation=_numbers(root_rotation, 4, "root_rotation"),
        root_velocity=_numbers(root_velocity, 3, "root_velocity"),
        root_angular_velocity=_numbers(root_angular_velocity, 3, "root_angular_velocity"),
        joint_position=_numbers(joint_position, 36, "joint_position"),
        joint_velocity=_numbers(still, 28, "joint_velocity"),
    )


def situation(character: pb.Pose, thing: pb.Furniture | pb.CarriedBox) -> pb.Situation:
    """Return a character with its piece of furniture or box."""
    if isinstance(thing, pb.Furniture):
        return pb.Situation(pose=character, furniture=thing)
    return pb.Situation(pose=character, box=thing)


def _turn(yaw: float) -> list[float]:
    return [math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw)]


def _numbers(values: ArrayLike, count: int, name: str) -> list[float]:
    array = np.asarray(values, np.float64)
    if array.shape != (count,):
        raise ValueError(f"{name}: must be [{count}], is {list(array.shape)}")
    return array.tolist()

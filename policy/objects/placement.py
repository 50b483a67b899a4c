"""Furniture of messages: the piece, its position and its use point."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from policy.errors import RequestError
from policy.fields import Numbers, number, quaternion, upright, vector
from policy.objects.columns import COLUMNS
from rpc.v1 import policy_pb2 as pb
from world.errors import InhabitError
from world.furniture import catalogue
from world.furniture.piece import UPRIGHT, Box, Piece, Quaternion, Vector
from world.furniture.usage import UsePoint, usage, use_points
from world.tasks import Task

SCALES = (0.2, 5.0)
#: Bounds of a piece of furniture, m: largest coordinate, and least half edge of a box.
_LARGE_M, _THIN_M = 20.0, 5e-4


@dataclass(frozen=True)
class PlacedFurniture:
    """A piece of furniture at its position, with one of its use points."""

    piece: Piece
    use_point: UsePoint
    """Use point in the piece's frame."""
    position: Numbers
    """[3]: origin of the piece's frame in the world, m."""
    yaw: float
    """Yaw of the piece's frame, rad."""

    def moved(self, position: Numbers, yaw: float) -> "PlacedFurniture":
        """The same furniture at another position [3], m, and yaw, rad."""
        return PlacedFurniture(self.piece, self.use_point, position, yaw)


@lru_cache(maxsize=512)
def piece_of(name: str, scale: float) -> Piece:
    """Piece of the catalogue at a scale; RequestError for an unknown name."""
    try:
        return catalogue.find(name).scaled(scale)
    except InhabitError as error:
        raise RequestError(f"furniture.piece: {error}") from error


def placed_furniture(
    furniture: pb.Furniture, task: Task, anywhere: bool = False
) -> PlacedFurniture:
    """Furniture of a message; RequestError names a wrong field.

    anywhere: position and rotation are optional; their defaults are the origin, facing +x.
    """
    shape = furniture.WhichOneof("shape")
    if shape == "piece":
        scale = furniture.scale if furniture.HasField("scale") else 1.0
        piece = piece_of(furniture.piece, number(scale, "furniture.scale", *SCALES))
        use_point = _use_point(piece, task, furniture.place)
    elif shape == "custom":
        piece, use_point = custom(furniture.custom, task)
    else:
        raise RequestError(
            "furniture: must have a piece (of the catalogue) or a custom shape (a mesh in "
            "Synthesize only)"
        )
    return place(furniture, piece, use_point, anywhere)


def place(
    furniture: pb.Furniture, piece: Piece, use_point: UsePoint, anywhere: bool = False
) -> PlacedFurniture:
    """The piece at the position and rotation of the message."""
    position, yaw = np.zeros(3), 0.0
    if furniture.position or not anywhere:
        position = vector(furniture.position, "furniture.position", 3)
    if furniture.rotation or not anywhere:
        yaw = upright(furniture.rotation, "furniture.rotation")
    return PlacedFurniture(piece, use_point, position, yaw)


MAX_BOXES = 64
"""Most boxes of one custom shape."""


def custom(shape: pb.Shape, task: Task) -> tuple[Piece, UsePoint]:
    """Piece and use point of a custom shape, made of its boxes or of its bounding box."""
    where = "furniture.custom"
    if len(shape.boxes) > MAX_BOXES:
        raise RequestError(f"{where}.boxes: {len(shape.boxes)}, must be at most {MAX_BOXES}")
    boxes = [_box(box, f"{where}.boxes[{i}]") for i, box in enumerate(shape.boxes)]
    if not boxes:
        low, high = (
            vector(getattr(shape, end), f"{where}.{end}", 3, _LARGE_M) for end in ("low", "high")
        )
        if not (high - low > 2 * _THIN_M).all():
            raise RequestError(f"{where}.high: must be above {where}.low, by a millimetre at least")
        boxes = [Box(_triple((low + high) / 2), _triple((high - low) / 2))]
    hip = _triple(vector(shape.hip, f"{where}.hip", 3, _LARGE_M))
    facing = number(shape.facing_rad, f"{where}.facing_rad", -7.0, 7.0)
    head = hip
    if usage(task.affordance.name).wide:
        head = _triple(vector(shape.head, f"{where}.head", 3, _LARGE_M))
    try:
        piece = Piece("custom", "custom", tuple(boxes), (), 1.0)
    except InhabitError as error:
        raise RequestError(f"{where}.boxes: {error}") from error
    return piece, UsePoint(hip, head, facing)


def fill_target(row: Numbers, where: PlacedFurniture) -> None:
    """Write the target of furniture into a pose row, in the world frame."""

    def world(points: Numbers | Vector) -> Numbers:
        return turned(points, where.yaw) + where.position

    heading = where.yaw + where.use_point.facing_rad
    row[COLUMNS["point"]] = world(where.use_point.point_m)
    row[COLUMNS["head"]] = world(where.use_point.head_m)
    row[COLUMNS["facing"]] = np.cos(heading), np.sin(heading)
    row[COLUMNS["corners"]] = world(where.use_point.corners(where.piece)).ravel()


def turned(points: Numbers | Vector, yaw: float) -> Numbers:
    """Points [..., 3] rotated about z by yaw, rad."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(points) @ turn.T


def mesh_use_point(piece: Piece, furniture: pb.Furniture, task: Task) -> UsePoint:
    """Use point of a piece made from a mesh, by the index `place` of the message."""
    return _use_point(piece, task, furniture.place)


def _use_point(piece: Piece, task: Task, index: int) -> UsePoint:
    try:
        found = use_points(piece, task.affordance.name)
    except InhabitError as error:
        raise RequestError(f"furniture: {error}") from error
    if not 0 <= index < len(found):
        raise RequestError(f"furniture.place: {index}, must be 0 to {len(found) - 1}")
    return found[index]


def _box(box: pb.SolidBox, name: str) -> Box:
    half = vector(box.half, f"{name}.half", 3, _LARGE_M)
    if not (half > _THIN_M).all():
        raise RequestError(f"{name}.half: must be more than {_THIN_M:g} m each")
    rotation = UPRIGHT if not box.rotation else _four(quaternion(box.rotation, f"{name}.rotation"))
    return Box(_triple(vector(box.centre, f"{name}.centre", 3, _LARGE_M)), _triple(half), rotation)


def _triple(array: Numbers) -> Vector:
    x, y, z = (float(value) for value in array)
    return x, y, z


def _four(array: Numbers) -> Quaternion:
    w, x, y, z = (float(value) for value in array)
    return w, x, y, z

"""A piece of furniture: collision shapes in its own frame, and targets for sitting and lying."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from world.errors import PieceError

SLOTS = 8
"""Collision boxes of every piece's model; a piece may use fewer."""

MOST_HULLS = 16
"""Greatest number of convex hulls of a piece, instead of boxes."""

TEST_SCALES = (0.8, 1.0, 1.2)
"""Scales of a piece at which its seat targets are drop-tested."""

Affordance = Literal["sit", "lie"]
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

UPRIGHT: Quaternion = (1.0, 0.0, 0.0, 0.0)

HIP_TO_HEAD_M = 0.635
"""From the character's root to the centre of its head, straightened out (humanoid.xml)."""


@dataclass(frozen=True)
class Box:
    """A solid box."""

    centre_m: Vector
    """Centre in the piece's frame."""
    half_m: Vector
    """Half of its edge lengths along its own axes (MuJoCo's `size` of a box geom)."""
    quat: Quaternion = UPRIGHT
    """Rotation from the box's axes to the piece's, unit quaternion w, x, y, z."""

    def corners(self) -> NDArray[np.float64]:
        """Corners in the piece's frame, [8, 3] in m."""
        return self.centre_m + (_SIGNS * self.half_m) @ rotation(self.quat).T


@dataclass(frozen=True)
class Hull:
    """A solid convex hull."""

    vertices_m: tuple[Vector, ...]
    """Corners in the piece's frame."""
    faces: tuple[tuple[int, int, int], ...]
    """Triangles of its surface, as indices of vertices, anticlockwise from outside."""


@dataclass(frozen=True)
class SeatTarget:
    """A target for sitting."""

    point_m: Vector
    """Point on the seat's surface below the pelvis; piece frame."""
    facing_rad: float = 0.0
    """Heading of a seated character about +z; 0 is +x, the piece's front."""
    seat_m: float | None = None
    """Height of the seat where it is above the point: the upper part of a seat that slopes or sags,
    as furniture is measured; None: that of the point."""
    rests_at: tuple[float, ...] | None = None
    """The TEST_SCALES at which a dropped ragdoll rests here; None: not tested, as for the package's
    own pieces, whose unit tests do that."""


@dataclass(frozen=True)
class Lying:
    """A target for lying: two points on the surface, piece frame."""

    hip_m: Vector
    """Below the hip."""
    head_m: Vector
    """Below the head, about HIP_TO_HEAD_M from the hip."""


@dataclass(frozen=True)
class Piece:
    """A piece in its own frame: metres, z up, +x front, origin on the floor below its centre.

    The centre is that of the axis-aligned bounding box. Raises PieceError when it has no box, more
    than SLOTS (with hulls, MOST_HULLS), or a box without volume.
    """

    name: str
    category: str
    boxes: tuple[Box, ...]
    sit: tuple[SeatTarget, ...]
    mass_kg: float
    seed: int = 0
    """Seed of its catalogue; with the name it identifies the piece."""
    licence: str = "Apache-2.0"
    lie: Lying | None = None
    """Target for lying, if any."""
    hulls: tuple[Hull, ...] = ()
    """Collision shapes instead of the boxes, which are then the bounding boxes of the hulls."""
    credit: str = ""
    """Author, where the licence requires attribution."""

    def __post_init__(self) -> None:
        most = MOST_HULLS if self.hulls else SLOTS
        if not 1 <= len(self.boxes) <= most:
            raise PieceError(f"{self.name}: {len(self.boxes)} boxes; choose 1 to {most}")
        if self.hulls and len(self.hulls) != len(self.boxes):
            raise PieceError(f"{self.name}: {len(self.hulls)} hulls in {len(self.boxes)} boxes")
        if any(min(box.half_m) <= 0.0 for box in self.boxes):
            raise PieceError(f"{self.name}: a box without volume; every edge must be longer than 0")

    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lowest and highest corner of the axis-aligned bounding box, each [3] in m."""
        points = (
            np.concatenate([np.array(hull.vertices_m) for hull in self.hulls])
            if self.hulls
            else np.concatenate([box.corners() for box in self.boxes])
        )
        return points.min(axis=0), points.max(axis=0)

    @property
    def size_m(self) -> Vector:
        """Edge lengths of the bounding box, x, y, z."""
        low, high = self.bounds()
        return _vector(high - low)

    def corners(self) -> NDArray[np.float64]:
        """Corners of the bounding box, [8, 3] in m; x changes slowest, z fastest, low first."""
        low, high = self.bounds()
        return np.where(_SIGNS > 0, high, low)

    def scaled(self, scale: float) -> "Piece":
        """The piece scaled about its origin; its mass scales with the volume, and results of drop
        tests are dropped.

        Raises PieceError unless scale > 0.
        """
        if not scale > 0.0:
            raise PieceError(f"{self.name}: scale {scale}; choose a number above 0")
        return replace(
            self,
            boxes=tuple(
                Box(_vector(scale * _of(b.centre_m)), _vector(scale * _of(b.half_m)), b.quat)
                for b in self.boxes
            ),
            sit=tuple(_seat_scaled(p, scale) for p in self.sit),
            lie=None if self.lie is None else _lying_scaled(self.lie, scale),
            hulls=tuple(
                replace(h, vertices_m=tuple(_vector(scale * _of(v)) for v in h.vertices_m))
                for h in self.hulls
            ),
            mass_kg=self.mass_kg * scale**3,
        )

    def boxes_padded(
        self, slots: int = SLOTS
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
        """The boxes in S slots: centre [S, 3] m, half [S, 3] m, quat [S, 4] wxyz, used [S].

        Unused slots hold a box of 2 mm at the origin (a geom needs a volume): disable them.
        """
        count = len(self.boxes)
        centre = np.zeros((slots, 3))
        half = np.full((slots, 3), 1e-3)
        quat = np.tile(np.array(UPRIGHT), (slots, 1))
        centre[:count] = [box.centre_m for box in self.boxes]
        half[:count] = [box.half_m for box in self.boxes]
        quat[:count] = [box.quat for box in self.boxes]
        return centre, half, quat, np.arange(slots) < count


def assemble(
    category: str,
    boxes: list[Box],
    targets: SeatTarget | Sequence[SeatTarget],
    mass_kg: float,
    lie: Lying | None = None,
) -> Piece:
    """A piece of boxes in any frame with z up, moved to the piece's frame."""
    sit = (targets,) if isinstance(targets, SeatTarget) else tuple(targets)
    piece = Piece(category, category, tuple(boxes), sit, mass_kg, lie=lie)
    low, high = piece.bounds()
    return moved(piece, -np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]]))


def moved(piece: Piece, offset_m: NDArray[np.float64]) -> Piece:
    """The piece with shapes and targets shifted by offset_m [3] in its frame."""
    lie = piece.lie

    def shifted(vector: Vector) -> Vector:
        return _vector(_of(vector) + offset_m)

    return replace(
        piece,
        boxes=tuple(replace(b, centre_m=shifted(b.centre_m)) for b in piece.boxes),
        sit=tuple(
            replace(
                p,
                point_m=shifted(p.point_m),
                seat_m=None if p.seat_m is None else p.seat_m + float(offset_m[2]),
            )
            for p in piece.sit
        ),
        lie=None if lie is None else Lying(shifted(lie.hip_m), shifted(lie.head_m)),
        hulls=tuple(
            replace(h, vertices_m=tuple(shifted(v) for v in h.vertices_m)) for h in piece.hulls
        ),
    )


def _seat_scaled(target: SeatTarget, scale: float) -> SeatTarget:
    """The target of a scaled piece, not tested."""
    seat = None if target.seat_m is None else scale * target.seat_m
    return SeatTarget(_vector(scale * _of(target.point_m)), target.facing_rad, seat)


def _lying_scaled(lie: Lying, scale: float) -> Lying:
    """The lying target of a scaled piece: the head moves with its pillow, and the hip keeps its
    distance from it, since the character does not scale."""
    hip, head = scale * _of(lie.hip_m), scale * _of(lie.head_m)
    along = (hip - head)[:2] / scale
    return Lying(_vector(np.append(head[:2] + along, hip[2])), _vector(head))


def rotation(quat: Quaternion) -> NDArray[np.float64]:
    """Rotation matrix [3, 3] of a unit quaternion w, x, y, z."""
    w, x, y, z = quat
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


_SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)


def _of(vector: Vector) -> NDArray[np.float64]:
    return np.array(vector, dtype=np.float64)


def _vector(array: NDArray[np.float64]) -> Vector:
    x, y, z = array.tolist()
    return x, y, z

"""A piece of furniture: collision boxes in its own frame, and the places where one can sit."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from world.errors import PieceError

SLOTS = 8
"""Collision boxes that every piece's model reserves; a piece may use fewer, never more."""

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

UPRIGHT: Quaternion = (1.0, 0.0, 0.0, 0.0)


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
        """Its corners in the piece's frame, [8, 3] in m."""
        return self.centre_m + (_SIGNS * self.half_m) @ rotation(self.quat).T


@dataclass(frozen=True)
class Place:
    """Where a character can sit."""

    point_m: Vector
    """Centre, on the seat's surface, of where the pelvis rests; piece frame."""
    facing_rad: float = 0.0
    """Heading of a seated character about +z; 0 is +x, the piece's front."""


@dataclass(frozen=True)
class Piece:
    """A piece in its own frame: metres, z up, +x front, origin on the floor below its centre.

    The centre is that of the axis-aligned bounding box. Raises PieceError when it has no box, more
    than SLOTS, or a box without volume.
    """

    name: str
    category: str
    boxes: tuple[Box, ...]
    sit: tuple[Place, ...]
    mass_kg: float
    seed: int = 0
    """Seed of the catalogue that it was drawn in; with the name it identifies the piece."""
    licence: str = "Apache-2.0"

    def __post_init__(self) -> None:
        if not 1 <= len(self.boxes) <= SLOTS:
            raise PieceError(f"{self.name}: {len(self.boxes)} boxes; choose 1 to {SLOTS}")
        if any(min(box.half_m) <= 0.0 for box in self.boxes):
            raise PieceError(f"{self.name}: a box without volume; every edge must be longer than 0")

    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lowest and highest corner of the axis-aligned bounding box, each [3] in m."""
        points = np.concatenate([box.corners() for box in self.boxes])
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
        """The piece enlarged about its origin; its mass grows with its volume.

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
            sit=tuple(Place(_vector(scale * _of(p.point_m)), p.facing_rad) for p in self.sit),
            mass_kg=self.mass_kg * scale**3,
        )

    def boxes_padded(
        self,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
        """The boxes in SLOTS slots: centre [S, 3] m, half [S, 3] m, quat [S, 4] wxyz, used [S].

        Unused slots hold a box of 2 mm at the origin (a geom needs a volume): disable them.
        """
        count = len(self.boxes)
        centre = np.zeros((SLOTS, 3))
        half = np.full((SLOTS, 3), 1e-3)
        quat = np.tile(np.array(UPRIGHT), (SLOTS, 1))
        centre[:count] = [box.centre_m for box in self.boxes]
        half[:count] = [box.half_m for box in self.boxes]
        quat[:count] = [box.quat for box in self.boxes]
        return centre, half, quat, np.arange(SLOTS) < count


def assemble(
    category: str, boxes: list[Box], place: Place, mass_kg: float, name: str | None = None
) -> Piece:
    """A piece from boxes in any frame with z up: moved until its origin is where it belongs."""
    piece = Piece(name or category, category, tuple(boxes), (place,), mass_kg)
    low, high = piece.bounds()
    origin = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
    return replace(
        piece,
        boxes=tuple(replace(b, centre_m=_vector(_of(b.centre_m) - origin)) for b in boxes),
        sit=(replace(place, point_m=_vector(_of(place.point_m) - origin)),),
    )


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

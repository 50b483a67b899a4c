"""Furnished rooms from a seed: pieces of the package's catalogue along the sides, the middle free,
and boxes on stands."""

import math
from dataclasses import dataclass

import numpy as np

from console.kinds.setup import Pose
from world.config import CarryConfig
from world.furniture import catalogue
from world.furniture.piece import Piece
from world.scene import box as box_scene


@dataclass(frozen=True)
class Furnished:
    """A piece in the room."""

    name: str
    """Name on the page."""
    piece: Piece
    pose: Pose
    """Of its origin."""


@dataclass(frozen=True)
class Layout:
    """A furnished room."""

    pieces: tuple[Furnished, ...]
    stands: tuple[Pose, ...]
    """Poses of the stands: the first ones hold the boxes, the last is free."""
    boxes: tuple[Piece, ...]
    stand_m: float
    """Height of the stands, m."""
    start: Pose
    """Initial pose of the character."""


@dataclass(frozen=True)
class _Spot:
    """A place for a class of furniture; degrees."""

    category: str
    x: float
    y: float
    degrees: float


#: +x is a piece's front. A bed is entered from its sides, its head is at its back.
_SPOTS = {
    "sofa": _Spot("sofa", 1.0, 3.0, -90.0),
    "armchair": _Spot("armchair", 3.3, 1.4, -160.0),
    "chair": _Spot("chair", 3.4, -0.6, 180.0),
    "table": _Spot("table", 3.2, -2.4, 180.0),
    "stool": _Spot("low-stool", 0.9, -3.0, 90.0),
    "high stool": _Spot("high-stool", -1.0, -3.1, 90.0),
    "bed": _Spot("bed", -3.1, -1.3, 0.0),
}
_STANDS = (Pose(-1.6, 2.9), Pose(-3.2, 2.3), Pose(-3.3, 0.7))
#: Pieces of the test split to draw from, and how far a piece is from its spot, m and degrees.
_PIECES, _SHIFT_M, _TURN_DEG = 8, 0.15, 8.0
#: Sizes of the boxes, as multiples of the default one.
_BOXES = (1.0, 0.8)


def furnished(seed: int) -> Layout:
    """The room of a seed."""
    random = np.random.default_rng(seed)
    pieces = []
    for name, spot in _SPOTS.items():
        number = int(random.integers(_PIECES))
        x, y, turn = random.uniform(-1.0, 1.0, 3).tolist()
        pose = Pose(
            spot.x + _SHIFT_M * x,
            spot.y + _SHIFT_M * y,
            math.radians(spot.degrees + _TURN_DEG * turn),
        )
        piece = catalogue.find(f"{spot.category}-test-{number:03d}")
        pieces.append(Furnished(name, piece, pose))
    return Layout(
        pieces=tuple(pieces),
        stands=_STANDS,
        boxes=tuple(box_scene.box(scale) for scale in _BOXES),
        stand_m=sum(CarryConfig().stand_m) / 2,
        start=Pose(0.0, 0.0, math.radians(float(random.uniform(-180.0, 180.0)))),
    )

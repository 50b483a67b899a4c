"""What a clip rests on, made to fit it: a stand under its box, or a seat or bed that no part of the
body runs through."""

from dataclasses import dataclass

from world.furniture.piece import Box, Piece
from world.motions.clip import Clip
from world.scene.box import STAND

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Support:
    """A piece and where it stands in the clip's world."""

    piece: Piece
    origin_m: Point
    yaw_rad: float
    point_m: Point
    """The point of use, on its surface."""
    head_m: Point
    """Below the head; of a seat the point itself."""


def support(clip: Clip) -> Support:
    """What holds the box, or the character, of a clip; a stand that is out of the way where it uses
    nothing."""
    return Support(STAND, AWAY_M, 0.0, AWAY_M, AWAY_M)


#: Where things stand that a clip does not use, m.
AWAY_M: Point = (-50.0, 0.0, 0.2)

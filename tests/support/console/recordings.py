"""A recording of a few frames."""

import numpy as np

from console.recording.format import Take, boxes_of
from world.character import model as character
from world.furniture.catalogue import catalogue


def take(steps: int = 4) -> Take:
    """A character that stands still beside a chair."""
    piece = catalogue("test", 1)[0].scaled(1.1)
    qpos = np.tile(character.standing_qpos(), (steps, 1))
    return Take(
        qpos,
        np.zeros((steps, 34)),
        np.zeros((steps, 28)),
        np.tile([1.0, 0.5, 0.0], (steps, 1)),
        np.tile([1.0, 0.0, 0.0, 0.0], (steps, 1)),
        boxes_of(piece),
        piece.name,
        1.1,
        {"distance_m": 1.0},
    )

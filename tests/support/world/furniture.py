"""Surfaces of furniture, looked for with rays."""

import math

import numpy as np

from world.furniture.piece import Piece, rotation


def top_below(piece: Piece, x: float, y: float) -> float:
    """Highest point of the piece on the vertical line through x, y; -inf where there is none."""
    best = -math.inf
    for box in piece.boxes:
        turn = rotation(box.quat)
        # In the box's axes, the ray from 10 m up: start + s * direction, clipped by three slabs.
        start = turn.T @ (np.array([x, y, 10.0]) - box.centre_m)
        direction = turn.T @ np.array([0.0, 0.0, -1.0])
        enter, leave = 0.0, math.inf
        for a in range(3):
            if abs(direction[a]) < 1e-12:
                if abs(start[a]) > box.half_m[a]:
                    leave = -math.inf
                continue
            ends = sorted((s * box.half_m[a] - start[a]) / direction[a] for s in (-1, 1))
            enter, leave = max(enter, ends[0]), min(leave, ends[1])
        if enter <= leave:
            best = max(best, 10.0 - enter)
    return best

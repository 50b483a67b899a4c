"""The character's bones, masses and soles, and their positions in a pose."""

import numpy as np

from world.character.model import PARENTS
from world.character.soles import ANKLE_M, HALF_WIDTH_M, HEEL_M, TOE_M
from world.motions.synthetic.rotations import Array, turn

HIP_M = 0.084887
THIGH_M = 0.421546
SHIN_M = 0.40987
LEG_M = THIGH_M + SHIN_M
UPPER_ARM_M = 0.274788
FOREARM_M = 0.258947

OFFSETS_M = np.array(
    [
        [0, 0, 0],
        [0, 0, 0.236151],
        [0, 0, 0.223894],
        [-0.02405, -0.18311, 0.2435],
        [0, 0, -UPPER_ARM_M],
        [0, 0, -FOREARM_M],
        [-0.02405, 0.18311, 0.2435],
        [0, 0, -UPPER_ARM_M],
        [0, 0, -FOREARM_M],
        [0, -HIP_M, 0],
        [0, 0, -THIGH_M],
        [0, 0, -SHIN_M],
        [0, HIP_M, 0],
        [0, 0, -THIGH_M],
        [0, 0, -SHIN_M],
    ]
)
"""Each body's origin in its parent's frame, [15, 3]."""

MASSES_KG = np.array([10, 12, 3.9, 1.5, 1, 0.5, 1.5, 1, 0.5, 4.5, 3, 1, 4.5, 3, 1])

CENTRES_M = np.array(
    [
        [0, 0, 0.12],
        [0, 0, 0.13],
        [0, 0, 0.175],
        [0, 0, -0.14],
        [0, 0, -0.12],
        [0, 0, 0],
        [0, 0, -0.14],
        [0, 0, -0.12],
        [0, 0, 0],
        [0, 0, -0.21],
        [0, 0, -0.20],
        [0.045, 0, -0.0225],
        [0, 0, -0.21],
        [0, 0, -0.20],
        [0.045, 0, -0.0225],
    ]
)
"""Each body's centre of mass in its own frame, from its shapes, [15, 3]."""

SIDES = (-1.0, 1.0)
"""Sign of y of the right and the left side, always in that order."""


def forward(root_m: Array, local: Array) -> tuple[Array, Array]:
    """World positions [T, 15, 3] and rotations [T, 15, 3, 3] of all bodies.

    Args:
        root_m: pelvis origin in the world, [T, 3].
        local: rotation of each body in its parent's frame (root: in the world), [T, 15, 3, 3].
    """
    positions, rotations = np.empty(local.shape[:-1]), np.empty_like(local)
    positions[:, 0], rotations[:, 0] = root_m, local[:, 0]
    for body, parent in enumerate(PARENTS[1:], start=1):
        rotations[:, body] = rotations[:, parent] @ local[:, body]
        positions[:, body] = positions[:, parent] + turn(rotations[:, parent], OFFSETS_M[body])
    return positions, rotations


def centre_of_mass(positions_m: Array, rotations: Array) -> Array:
    """The whole body's centre of mass in the world, [T, 3]."""
    centres = positions_m + turn(rotations, CENTRES_M)
    return np.einsum("b,tbi->ti", MASSES_KG, centres) / MASSES_KG.sum()


def sole_corners(positions_m: Array, rotations: Array, side: int) -> Array:
    """The four corners of the right (0) or left (1) sole in the world, [T, 4, 3]."""
    foot = 11 + 3 * side
    corners = np.array(
        [[x, y, -ANKLE_M] for x in (HEEL_M, TOE_M) for y in (-HALF_WIDTH_M, HALF_WIDTH_M)]
    )
    return positions_m[:, foot, None] + np.einsum("tij,cj->tci", rotations[:, foot], corners)

"""MuJoCo models of one character, a floor and one piece of furniture in a fixed number of collision
slots.

Every model has the same layout, so that one Batch steps any mixture of pieces and a scene changes
its piece between episodes without a rebuild.
"""

import mujoco
import numpy as np

from world import character
from world.furniture.piece import SLOTS, Box, Piece

FURNITURE_BODY = "furniture"
#: Collision bits: the character meets whatever is solid; an unused slot meets nothing, yet keeps
#: its node in the body's bounding-volume tree, so that every piece gives the same layout.
_SOLID, _CHARACTER, _UNUSED = 2, 1, 4

_NOTHING = Piece("nothing", "none", (Box((0.0, 0.0, 0.0), (1e-3, 1e-3, 1e-3)),), (), 1.0)


def compile_scene(piece: Piece | None) -> mujoco.MjModel:
    """The model of a scene with `piece` (None: an empty floor, all slots parked).

    The furniture is a mocap body: it is placed by writing mocap_pos and mocap_quat (piece frame:
    origin on the floor, z up, +x front) and costs no joint to integrate.
    """
    spec = character.spec()
    # Newton to 1e-5 instead of 1e-8 and one island: velocities after a control step agree to 2e-6,
    # and the step takes a fifth less time. Capping the iterations instead would let hard contacts
    # explode.
    spec.option.tolerance = 1e-5
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ISLAND)
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0, 0, 0.05],
        contype=_SOLID,
        conaffinity=_CHARACTER,
        friction=[1.0, 0.05, 0.001],
        rgba=[0.93, 0.93, 0.9, 1],
    )
    body = spec.worldbody.add_body(name=FURNITURE_BODY, mocap=True)
    centre, half, quat, used = (piece or _NOTHING).boxes_padded()
    if piece is None:
        used = np.zeros(SLOTS, dtype=bool)
    for slot in range(SLOTS):
        body.add_geom(
            name=f"slot{slot}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=half[slot],
            pos=centre[slot],
            quat=quat[slot],
            contype=_SOLID if used[slot] else _UNUSED,
            conaffinity=_CHARACTER if used[slot] else _UNUSED,
            friction=[1.0, 0.05, 0.001],
            rgba=[0.72, 0.53, 0.36, 1.0 if used[slot] else 0.0],
        )
    return spec.compile()

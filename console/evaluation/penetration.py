"""Penetration of the character into the furniture, from the simulator's contacts."""

from collections.abc import Iterable

import mujoco
import numpy as np
from numpy.typing import NDArray

from world.character import model as character
from world.scene.model import FURNITURE_BODY


def depth(
    model: mujoco.MjModel,
    qpos: NDArray[np.float64],
    position: NDArray[np.float64],
    quat: NDArray[np.float64],
    frames: Iterable[int],
) -> NDArray[np.float64]:
    """Return the deepest overlap of character and furniture in each of `frames`, m; 0 without any.

    qpos [T, 43 or more]; position [T, 3] m and quat [T, 4] of the furniture, world.
    """
    data = mujoco.MjData(model)
    furniture = model.body(FURNITURE_BODY).id
    own = model.body(character.BODIES[0]).id
    is_own = model.body_rootid[model.geom_bodyid] == own
    is_furniture = model.geom_bodyid == furniture
    deepest = []
    for frame in frames:
        data.qpos[: character.NQ] = qpos[frame, : character.NQ]
        data.mocap_pos[0], data.mocap_quat[0] = position[frame], quat[frame]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        contact = data.contact
        first, second = contact.geom[:, 0], contact.geom[:, 1]
        between = (is_own[first] & is_furniture[second]) | (is_furniture[first] & is_own[second])
        overlap = -contact.dist[between]
        deepest.append(max(0.0, float(overlap.max())) if len(overlap) else 0.0)
    return np.array(deepest)

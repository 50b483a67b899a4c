"""A seated ragdoll let down on a place: where it comes to rest, and how deep it sinks in."""

from dataclasses import dataclass

import mujoco
import numpy as np

from world import seated
from world.furniture.piece import Piece
from world.scene import FURNITURE_BODY, compile_scene


@dataclass(frozen=True)
class Rest:
    """What a drop came to."""

    height_error_m: float
    """Of the surface that carries it above the place, as its root's height tells."""
    off_m: float
    """Of the root from above the place, horizontally."""
    speed_m_s: float
    """Of the root at the end."""
    deepest_m: float
    """Penetration of the furniture in the last second."""
    fastest_m_s: float
    """Of any body at any time after it landed."""
    finite: bool


def drop(piece: Piece, seconds: float = 3.0, above_m: float = 0.02, which: int = 0) -> Rest:
    """Let the ragdoll, its joints held seated by their servoes, down on a place of the piece."""
    model = compile_scene(piece)
    data = mujoco.MjData(model)
    furniture = model.body(FURNITURE_BODY).id
    place = piece.sit[which]
    # the legs stretched, if need be, until they clear the front of a deep seat
    for knee in (None, 1.0, 0.6):
        data.qpos[:] = seated.qpos(place, above_m, knee)
        data.ctrl[:] = seated.targets(place, knee)
        mujoco.mj_forward(model, data)
        if _deepest(model, data, furniture) < 0.005:
            break
    steps = round(seconds / model.opt.timestep)
    deepest = fastest = 0.0
    for step in range(steps):
        mujoco.mj_step(model, data)
        if step * model.opt.timestep > 0.5:
            fastest = max(fastest, float(np.abs(data.qvel[:3]).max()))
        if (steps - step) * model.opt.timestep <= 1.0:
            deepest = max(deepest, _deepest(model, data, furniture))
    finite = bool(np.isfinite(data.qpos).all()) and int(data.warning.number.sum()) == 0
    x, y, z = piece.sit[which].point_m
    root = data.qpos[:3]
    return Rest(
        float(root[2] - seated.THIGH_M - z),
        float(np.hypot(root[0] - x, root[1] - y)),
        float(np.linalg.norm(data.qvel[:3])),
        deepest,
        fastest,
        finite,
    )


def _deepest(model: mujoco.MjModel, data: mujoco.MjData, furniture: int) -> float:
    """Deepest penetration of the furniture, m; 0 for none."""
    depths = [
        -float(contact.dist)
        for contact in data.contact[: data.ncon]
        if furniture in model.geom_bodyid[contact.geom]
    ]
    return max([0.0, *depths])

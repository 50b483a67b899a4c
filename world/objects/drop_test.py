"""A seated ragdoll let down on a place: where it comes to rest, and how deep it sinks in."""

from dataclasses import dataclass, replace

import mujoco
import numpy as np
import torch

from world.furniture.piece import TEST_SCALES, Piece, SeatTarget, rotation
from world.objects import clearance, seated_pose
from world.scene.model import FURNITURE_BODY, compile_scene

#: A pose that stands no deeper in the piece than this can be let down, m.
_FREE_M = 0.005
#: Where the centre of mass should be ahead of the hips, m: above the thighs, behind any edge.
_BALANCED_M = 0.075
HIGHEST_M = 0.90
"""Seats that a scale makes higher are left out: training shrinks those pieces."""
#: When a ragdoll has to be at rest, s: soon, and still long after; some creep or sway off.
_SOON_S, _LONG_S = 3.0, 10.0
#: What counts as rest on the place: of the height, of penetration, of speed, of the way from it.
RAISED_M, DEEPEST_M, SPEED_M_S, OFF_M = 0.03, 0.015, 0.1, 0.25


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
    """Of the root at any time after it landed."""
    finite: bool
    """Whether every number stayed one, and MuJoCo warned of nothing."""

    @property
    def rests(self) -> bool:
        """Whether it came to rest on the place, at its height."""
        return (
            self.finite
            and abs(self.height_error_m) < RAISED_M
            and self.deepest_m < DEEPEST_M
            and self.speed_m_s < SPEED_M_S
            and self.off_m < OFF_M
        )


def scales(place: SeatTarget) -> tuple[float, ...]:
    """Those of TEST_SCALES that a piece is tried at, by the height of its place."""
    return tuple(scale for scale in TEST_SCALES if scale * place.point_m[2] <= HIGHEST_M)


def slips_at(place: SeatTarget) -> tuple[float, ...]:
    """Those at which it was tried in vain; none of a place that was not tried."""
    tried = () if place.rests_at is None else scales(place)
    return tuple(scale for scale in tried if scale not in (place.rests_at or ()))


def rests_at(piece: Piece, place: SeatTarget) -> tuple[float, ...]:
    """The scales at which a ragdoll let down on this place of the piece is at rest on it after 3 s,
    and still after 10."""
    found = []
    for scale in scales(place):
        sized = replace(piece, sit=(place,)).scaled(scale)
        if all(drop(sized, seconds).rests for seconds in (_SOON_S, _LONG_S)):
            found.append(scale)
    return tuple(found)


def drop(piece: Piece, seconds: float = 3.0, above_m: float = 0.02, which: int = 0) -> Rest:
    """Let the ragdoll, its joints held seated by their servos, down on a place of the piece."""
    model = compile_scene(piece)
    # nobody tells its servos anything new: MuJoCo holds them to their limits
    model.actuator_forcelimited[:] = True
    data = mujoco.MjData(model)
    furniture = model.body(FURNITURE_BODY).id
    place = piece.sit[which]
    pose = _balanced(model, data, piece, place, above_m)
    data.qpos[:] = seated_pose.qpos(place, above_m, pose)
    data.ctrl[:] = seated_pose.set_points(place, pose)
    steps = round(seconds / model.opt.timestep)
    deepest = fastest = 0.0
    for step in range(steps):
        mujoco.mj_step(model, data)
        if step * model.opt.timestep > 0.5:
            fastest = max(fastest, float(np.abs(data.qvel[:3]).max()))
        if (steps - step) * model.opt.timestep <= 1.0:
            deepest = max(deepest, _deepest(model, data, furniture))
    deepest = max(deepest, _inside(data, piece))
    finite = bool(np.isfinite(data.qpos).all()) and int(data.warning.number.sum()) == 0
    x, y, z = place.point_m
    root = data.qpos[:3]
    return Rest(
        float(root[2] - seated_pose.THIGH_M - z),
        float(np.hypot(root[0] - x, root[1] - y)),
        float(np.linalg.norm(data.qvel[:3])),
        deepest,
        fastest,
        finite,
    )


def _balanced(
    model: mujoco.MjModel, data: mujoco.MjData, piece: Piece, place: SeatTarget, above_m: float
) -> seated_pose.Pose:
    """The pose that stands in nothing and has its centre of mass above the thighs, as anyone's is
    who sits without holding on."""
    furniture = model.body(FURNITURE_BODY).id
    ahead = np.array([np.cos(place.facing_rad), np.sin(place.facing_rad)])
    found: list[tuple[float, seated_pose.Pose]] = []
    for pose in seated_pose.poses():
        data.qpos[:] = seated_pose.qpos(place, above_m, pose)
        mujoco.mj_forward(model, data)
        within = max(_deepest(model, data, furniture), _inside(data, piece))
        inside = max(0.0, within - _FREE_M)
        off = (data.subtree_com[1] - data.qpos[:3])[:2] @ ahead - _BALANCED_M
        found.append((10.0 * inside + abs(float(off)), pose))
    return min(found, key=lambda item: item[0])[1]


def _deepest(model: mujoco.MjModel, data: mujoco.MjData, furniture: int) -> float:
    """Deepest penetration of the furniture by any contact, m; 0 for none."""
    depths = [
        -float(contact.dist)
        for contact in data.contact[: data.ncon]
        if furniture in model.geom_bodyid[contact.geom]
    ]
    return max([0.0, *depths])


def _inside(data: mujoco.MjData, piece: Piece) -> float:
    """Deepest penetration of the piece's boxes by the spheres that fill the body, m; 0 for none,
    and for hulls, whose contacts are sound.

    MuJoCo's contacts of a capsule with a box overlook a limb that runs through a thin board.
    """
    if piece.hulls:
        return 0.0
    centres = clearance.points(torch.from_numpy(data.qpos[None]).float())[0].double().numpy()
    deepest = 0.0
    for box in piece.boxes:
        local = (centres - box.centre_m) @ rotation(box.quat)
        beyond = np.abs(local) - box.half_m
        outside = np.linalg.norm(beyond.clip(0.0), axis=1)
        distance = outside + beyond.max(axis=1).clip(max=0.0)
        deepest = max(deepest, float((clearance.RADII.double().numpy() - distance).max()))
    return deepest

"""Drop test: whether a seated ragdoll that is dropped on a seat target comes to rest on it."""

from dataclasses import dataclass, replace

import mujoco
import numpy as np
import torch

from world.furniture.piece import TEST_SCALES, Piece, SeatTarget, rotation
from world.objects import clearance, seated_pose
from world.scene.model import FURNITURE_BODY, compile_scene

#: Greatest penetration of the piece by a pose before the drop, m.
_FREE_M = 0.005
#: Wanted distance of the centre of mass ahead of the hips, m: above the thighs, behind any edge.
_BALANCED_M = 0.075
_SPARE_M = 0.004
"""Part of the tolerance of the height that `sinks_m` leaves."""
HIGHEST_M = 0.90
"""Greatest height of a scaled seat that is tested: training shrinks higher ones."""
#: Durations after which a ragdoll must be at rest, s: on some seats it creeps or sways off later.
_SOON_S, _LONG_S = 3.0, 10.0
#: Bounds of rest: error of the height, penetration, speed, horizontal distance.
RAISED_M, DEEPEST_M, SPEED_M_S, OFF_M = 0.03, 0.015, 0.1, 0.25


@dataclass(frozen=True)
class Rest:
    """Result of a drop."""

    height_error_m: float
    """Height of the root, less the thigh's radius, above the seat target."""
    off_m: float
    """Horizontal distance of the root from the seat target."""
    speed_m_s: float
    """Speed of the root at the end."""
    deepest_m: float
    """Greatest penetration of the furniture in the last second."""
    fastest_m_s: float
    """Greatest speed of the root after it landed."""
    finite: bool
    """Whether the state stayed finite, without a MuJoCo warning."""

    @property
    def rests(self) -> bool:
        """Whether the ragdoll rests on the seat target, at its height."""
        return (
            self.finite
            and abs(self.height_error_m) < RAISED_M
            and self.deepest_m < DEEPEST_M
            and self.speed_m_s < SPEED_M_S
            and self.off_m < OFF_M
        )


def scales(target: SeatTarget) -> tuple[float, ...]:
    """The TEST_SCALES at which a piece is tested, by the height of its seat target."""
    return tuple(scale for scale in TEST_SCALES if scale * target.point_m[2] <= HIGHEST_M)


def slips_at(target: SeatTarget) -> tuple[float, ...]:
    """The tested scales at which the ragdoll does not rest; empty for an untested seat target."""
    tried = () if target.rests_at is None else scales(target)
    return tuple(scale for scale in tried if scale not in (target.rests_at or ()))


def rests_at(piece: Piece, target: SeatTarget) -> tuple[float, ...]:
    """The scales at which a ragdoll rests on this seat target after 3 s and after 10 s."""
    found = []
    for scale in scales(target):
        sized = replace(piece, sit=(target,)).scaled(scale)
        if all(drop(sized, seconds).rests for seconds in (_SOON_S, _LONG_S)):
            found.append(scale)
    return tuple(found)


def sinks_m(piece: Piece, target: SeatTarget) -> float | None:
    """The least change of a target's height, m, with which the ragdoll rests on it at every scale;
    None where it is not its height alone that is wrong."""
    low, high = -np.inf, np.inf
    for scale in scales(target):
        sized = replace(piece, sit=(target,)).scaled(scale)
        rests = [drop(sized, seconds) for seconds in (_SOON_S, _LONG_S)]
        if not all(replace(rest, height_error_m=0.0).rests for rest in rests):
            return None
        within = RAISED_M - _SPARE_M
        low = max(low, *((rest.height_error_m - within) / scale for rest in rests))
        high = min(high, *((rest.height_error_m + within) / scale for rest in rests))
    return None if low > high else float(np.clip(0.0, low, high))


def drop(piece: Piece, seconds: float = 3.0, above_m: float = 0.02, which: int = 0) -> Rest:
    """Drop the ragdoll, held seated by its servos, on the seat target number `which` of a piece."""
    # the set-points are constant: MuJoCo's own force limits apply
    model = compile_scene(piece, limited=True)
    data = mujoco.MjData(model)
    furniture = model.body(FURNITURE_BODY).id
    target = piece.sit[which]
    pose = _balanced(model, data, piece, target, above_m)
    data.qpos[:] = seated_pose.qpos(target, above_m, pose)
    data.ctrl[:] = seated_pose.set_points(target, pose)
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
    x, y, z = target.point_m
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
    model: mujoco.MjModel, data: mujoco.MjData, piece: Piece, target: SeatTarget, above_m: float
) -> seated_pose.Pose:
    """The pose of least penetration whose centre of mass is above the thighs, for balance."""
    furniture = model.body(FURNITURE_BODY).id
    ahead = np.array([np.cos(target.facing_rad), np.sin(target.facing_rad)])
    found: list[tuple[float, seated_pose.Pose]] = []
    for pose in seated_pose.poses():
        data.qpos[:] = seated_pose.qpos(target, above_m, pose)
        mujoco.mj_forward(model, data)
        within = max(_deepest(model, data, furniture), _inside(data, piece))
        inside = max(0.0, within - _FREE_M)
        off = (data.subtree_com[1] - data.qpos[:3])[:2] @ ahead - _BALANCED_M
        found.append((10.0 * inside + abs(float(off)), pose))
    return min(found, key=lambda item: item[0])[1]


def _deepest(model: mujoco.MjModel, data: mujoco.MjData, furniture: int) -> float:
    """Deepest penetration of the furniture by contacts, m; 0 without one."""
    depths = [
        -float(contact.dist)
        for contact in data.contact[: data.ncon]
        if furniture in model.geom_bodyid[contact.geom]
    ]
    return max([0.0, *depths])


def _inside(data: mujoco.MjData, piece: Piece) -> float:
    """Deepest penetration of the piece's boxes by the spheres that fill the body, m; 0 without one,
    and for hulls, whose contacts are reliable.

    MuJoCo's capsule-box contacts miss a limb that passes through a thin board.
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

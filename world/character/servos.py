"""The 28 servos: their coordinates, and set-points that keep them within their effort limits.

A servo pulls with kp (set-point − q) − kd q̇. Where MuJoCo clamps that force, it excludes the servo
from its implicit integration: a limb of 0.01 kg m² on a servo of 50 N m s/rad then oscillates by
60 rad/s a substep, until the scene diverges (docs/explanation/physics.md). The effort is therefore
limited at each control step by the set-point: from there the force falls as the joint follows, and
the damping stays implicit.
"""

import torch
from torch import Tensor

from world import rotations
from world.character import model as character
from world.device import at

_BALLS = torch.tensor([range(address, address + 4) for address in character.BALL_QPOS])
_HINGES = torch.tensor(character.HINGE_QPOS)
_BALL_DOFS = [first + axis for first in character.BALL_DOF for axis in range(3)]
#: Index of each servo's coordinate in (vectors of all balls, angles of all hinges).
_ORDER = torch.tensor([*_BALL_DOFS, *character.HINGE_DOF]).argsort()
_KP, _KD = (torch.from_numpy(gain) for gain in character.gains())
_LIMIT = torch.from_numpy(character.effort_limits())


def coordinates(qpos: Tensor) -> Tensor:
    """Coordinates [n, 28] rad of the servos at qpos [n, 43]: rotation vectors of balls, angles of
    hinges; MuJoCo's actuator_length."""
    balls, hinges, order = (at(index, qpos) for index in (_BALLS, _HINGES, _ORDER))
    vectors = rotations.to_rotation_vector(qpos[:, balls])
    return torch.cat((vectors.flatten(1), qpos[:, hinges]), dim=1)[:, order]


def limited(target: Tensor, qpos: Tensor, qvel: Tensor) -> Tensor:
    """Set-points [n, 28] rad, float64, moved so that servos at qpos [n, 43] and qvel [n, 34] pull
    within the effort limits of the character. They may lie outside the set-point bounds."""
    kp, kd, limit = (at(table, qpos) for table in (_KP, _KD, _LIMIT))
    here, damping = coordinates(qpos), kd * qvel[:, 6:]
    force = kp * (target - here) - damping
    held = torch.maximum(torch.minimum(force, limit), -limit)
    return torch.where(force == held, target, here + (held + damping) / kp)

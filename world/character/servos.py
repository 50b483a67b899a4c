"""The 28 servos: what they measure, and targets that keep them within their effort.

A servo pulls with kp (target − q) − kd q̇. Where MuJoCo itself clamps that force, it leaves the
servo out of its implicit integration for as long: a limb of 0.01 kg m² on a servo of
50 N m s/rad is then thrown to and fro by 60 rad/s a substep, until a scene that nobody ends blows
up (docs/recipe.md, "Random actions"). So the effort is limited where a servo is told what to do, at
each control step, by moving its target: from there the force falls as the joint follows, and
damping stays implicit.
"""

import torch
from torch import Tensor

from world import rotations
from world.character import model as character
from world.device import at

_BALLS = torch.tensor([range(address, address + 4) for address in character.BALL_QPOS])
_HINGES = torch.tensor(character.HINGE_QPOS)
_BALL_DOFS = [first + axis for first in character.BALL_DOF for axis in range(3)]
#: Where each servo's coordinate stands in (vectors of all balls, angles of all hinges).
_ORDER = torch.tensor([*_BALL_DOFS, *character.HINGE_DOF]).argsort()
_KP, _KD = (torch.from_numpy(gain) for gain in character.gains())
_LIMIT = torch.from_numpy(character.effort_limits())


def coordinates(qpos: Tensor) -> Tensor:
    """What the 28 servos measure at qpos [n, 43]: rotation vectors of balls, hinge angles, rad [n,
    28]; MuJoCo's actuator_length."""
    balls, hinges, order = (at(index, qpos) for index in (_BALLS, _HINGES, _ORDER))
    vectors = rotations.to_rotation_vector(qpos[:, balls])
    return torch.cat((vectors.flatten(1), qpos[:, hinges]), dim=1)[:, order]


def limited(target: Tensor, qpos: Tensor, qvel: Tensor) -> Tensor:
    """Targets [n, 28] rad, moved to where servos at qpos [n, 43] and qvel [n, 34] pull with no
    more than the character's table allows; float64. They may lie outside the bounds that policies
    have."""
    kp, kd, limit = (at(table, qpos) for table in (_KP, _KD, _LIMIT))
    here, damping = coordinates(qpos), kd * qvel[:, 6:]
    force = kp * (target - here) - damping
    held = torch.maximum(torch.minimum(force, limit), -limit)
    return torch.where(force == held, target, here + (held + damping) / kp)

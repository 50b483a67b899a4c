"""Set-point offsets of the arms by which both hands press on a box between them."""

import torch
from torch import Tensor

from world import rotations
from world.character import kinematics
from world.character import model as character

_SIDES = ("right", "left")
#: Step of a joint for finite differences, rad; single precision resolves 1e-6 m.
_STEP_RAD = 1e-2
#: Greatest offset of a set-point, rad.
_LARGEST_RAD = 0.5


def squeeze(qpos: Tensor, press_n: Tensor, weight_n: Tensor) -> Tensor:
    """Set-point offsets [m, 28] rad by which each hand presses towards the other with press_n [m] N
    and both bear a weight of weight_n [m] N.

    A servo at Δ from its set-point pulls with kp Δ, so that Δ = Jᵀ F / kp, with J the Jacobian of
    the hand's position in the arm's joint coordinates (by finite differences).
    """
    hands = [character.BODIES.index(f"{side}_hand") for side in _SIDES]
    here = _positions(qpos)[:, hands]
    line = here[:, 1] - here[:, 0]
    towards = line / line.norm(dim=1, keepdim=True).clamp_min(1e-6)
    up = qpos.new_tensor((0.0, 0.0, 0.5))
    kp = torch.from_numpy(character.gains()[0]).to(qpos)
    offset = qpos.new_zeros(len(qpos), character.NU)
    for side, hand, sign in zip(_SIDES, hands, (1.0, -1.0), strict=True):
        push = sign * press_n[:, None] * towards + weight_n[:, None] * up
        for control, moved in _bent(qpos, side):
            slope = (_positions(moved)[:, hand] - here[:, hands.index(hand)]) / _STEP_RAD
            offset[:, control] = (slope * push).sum(dim=1) / kp[control]
    return offset.clamp(-_LARGEST_RAD, _LARGEST_RAD)


def _positions(qpos: Tensor) -> Tensor:
    local = rotations.matrix(kinematics.local_rotations(qpos))
    return kinematics.forward(qpos[:, :3], local)[0]


def _bent(qpos: Tensor, side: str) -> list[tuple[int, Tensor]]:
    """The controls of an arm, each with qpos [m, 43] in which its joint is one step further."""
    found = []
    address, control = 7, 0
    for joint in character.JOINTS:
        mine = joint.name in (f"{side}_shoulder", f"{side}_elbow")
        if joint.is_ball:
            for axis in range(3) if mine else ():
                turn = qpos.new_zeros(4)
                turn[0], turn[1 + axis] = 1.0, 0.5 * _STEP_RAD
                moved = qpos.clone()
                ball = qpos[:, address : address + 4]
                turned = rotations.multiply(ball, rotations.normalise(turn).expand_as(ball))
                moved[:, address : address + 4] = turned
                found.append((control + axis, moved))
            address, control = address + 4, control + 3
        else:
            if mine:
                moved = qpos.clone()
                moved[:, address] += _STEP_RAD
                found.append((control, moved))
            address, control = address + 1, control + 1
    return found

"""Forward kinematics of the character in torch, level by level of its tree, from qpos alone.

MuJoCo's own body poses are one substep behind after a step; features built from qpos by one routine
are the same for simulation, mocap and serving.
"""

from functools import cache

import torch
from torch import Tensor

from world import character, rotations

#: Bodies of each level of the tree below the pelvis.
_LEVELS = ((1, 9, 12), (2, 3, 6, 10, 13), (4, 7, 11, 14), (5, 8))


@cache
def _offsets(device: str) -> Tensor:
    """Offset of each body from its parent, in the parent's frame, m: [15, 3], from the MJCF
    itself."""
    model = character.spec().compile()
    table = torch.tensor(model.body_pos[1:], dtype=torch.float32, device=device)
    table[0] = 0.0
    return table


def offsets(device: torch.device | str = "cpu") -> Tensor:
    """Body offsets in the parent's frame, m: [15, 3] float32; the root's is 0."""
    return _offsets(str(device))


def local_rotations(qpos: Tensor) -> Tensor:
    """Each body's rotation in its parent's frame (the root's in the world): qpos [n, 43] -> [n, 15,
    4]."""
    n = qpos.shape[0]
    local = qpos.new_zeros(n, 15, 4)
    local[..., 0] = 1.0
    local[:, 0] = qpos[:, 3:7]
    for body, joint in zip(character.JOINT_BODIES, character.JOINTS, strict=True):
        address = _address(body)
        if joint.is_ball:
            local[:, body] = qpos[:, address : address + 4]
        else:
            half = 0.5 * qpos[:, address]
            sign = -1.0 if "elbow" in joint.name else 1.0
            local[:, body, 0] = torch.cos(half)
            local[:, body, 2] = sign * torch.sin(half)
    return local


@cache
def _address(body: int) -> int:
    q = 7
    for b, joint in zip(character.JOINT_BODIES, character.JOINTS, strict=True):
        if b == body:
            return q
        q += 4 if joint.is_ball else 1
    raise KeyError(body)


def forward(root_position: Tensor, local: Tensor) -> tuple[Tensor, Tensor]:
    """World positions [n, 15, 3] (m) and rotations [n, 15, 4] of the bodies.

    Args: root_position [n, 3] m, world; local [n, 15, 4], each rotation in its parent's frame.
    """
    n = local.shape[0]
    position = local.new_empty(n, 15, 3)
    rotation = local.new_empty(n, 15, 4)
    position[:, 0], rotation[:, 0] = root_position, local[:, 0]
    offset = offsets(local.device).to(local.dtype)
    for level in _LEVELS:
        children = list(level)
        parents = [character.PARENTS[b] for b in children]
        parent_rotation = rotation[:, parents]
        rotation[:, children] = rotations.multiply(parent_rotation, local[:, children])
        position[:, children] = position[:, parents] + rotations.rotate(
            parent_rotation, offset[children].expand(n, -1, -1)
        )
    return position, rotation

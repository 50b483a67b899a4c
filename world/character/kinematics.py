"""Forward kinematics of the character in torch, level by level of its tree, from qpos alone.

MuJoCo's own body poses are one substep old after a step; features computed from qpos are the same
for simulation, mocap and serving.
"""

from functools import cache

import torch
from torch import Tensor

from world.character import model as character
from world.device import at

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


def _gather_index() -> Tensor:
    """[15, 4]: index of each body's local quaternion in (qpos, cosines, signed sines, 0, 1)."""
    zero, one = character.NQ + 8, character.NQ + 9
    index = torch.tensor([[one, zero, zero, zero]] * 15)
    index[0] = torch.arange(3, 7)
    hinges = 0
    address = 7
    for body, joint in zip(character.JOINT_BODIES, character.JOINTS, strict=True):
        if joint.is_ball:
            index[body] = torch.arange(address, address + 4)
            address += 4
        else:
            index[body, 0] = character.NQ + hinges
            index[body, 2] = character.NQ + 4 + hinges
            hinges, address = hinges + 1, address + 1
    return index


_GATHER = _gather_index().flatten()
_HALF_SIGN = 0.5 * torch.tensor(character.HINGE_SIGN)
_HINGES = torch.tensor(character.HINGE_QPOS)


def local_rotations(qpos: Tensor) -> Tensor:
    """Rotations [n, 15, 4] of the bodies in their parents' frames (the root's in the world) at qpos
    [n, 43].
    """
    half = qpos[:, at(_HINGES, qpos)] * at(_HALF_SIGN, qpos).to(qpos)
    constants = qpos.new_tensor((0.0, 1.0)).expand(len(qpos), 2)
    pool = torch.cat((qpos, torch.cos(half), torch.sin(half), constants), dim=1)
    return pool.index_select(1, at(_GATHER, qpos)).view(-1, 15, 4)


def _level_parents() -> tuple[Tensor, ...]:
    """For each level, indices of its bodies' parents in the level above."""
    above: tuple[int, ...] = (0,)
    parents = []
    for level in _LEVELS:
        parents.append(torch.tensor([above.index(character.PARENTS[body]) for body in level]))
        above = level
    return tuple(parents)


_PARENT_INDICES = _level_parents()
_LEVEL_IDS = tuple(torch.tensor(level) for level in _LEVELS)
#: Bodies in order of their levels, and index of each body in that order.
_BY_LEVEL = [0, *(body for level in _LEVELS for body in level)]
_BACK = torch.tensor([_BY_LEVEL.index(body) for body in range(15)])


def forward(root_position: Tensor, local: Tensor) -> tuple[Tensor, Tensor]:
    """World positions [n, 15, 3] (m) and rotation matrices [n, 15, 3, 3] of the bodies.

    Args: root_position [n, 3] m, world; local [n, 15, 3, 3], each rotation in its parent's frame.
    """
    offset = offsets(local.device).to(local.dtype)[..., None]
    position, rotation = root_position[:, None, :, None], local[:, :1]
    positions, matrices = [position], [rotation]
    for level, parents in zip(_LEVEL_IDS, _PARENT_INDICES, strict=True):
        level, parents = at(level, local), at(parents, local)
        parent = rotation.index_select(1, parents)
        position = position.index_select(1, parents) + parent @ offset[level]
        rotation = parent @ local.index_select(1, level)
        positions.append(position)
        matrices.append(rotation)
    back = at(_BACK, local)
    position = torch.cat(positions, dim=1).index_select(1, back)[..., 0]
    return position, torch.cat(matrices, dim=1).index_select(1, back)

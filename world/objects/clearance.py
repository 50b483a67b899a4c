"""Penetration of furniture, boxes and stands by the character: spheres along its limbs against
boxes.

Used to choose what fits a reference state: the chairs and stands of the clips were not recorded,
and contacts throw a character out of a backrest or a plate that it penetrates.
"""

from collections.abc import Sequence

import torch
from torch import Tensor

from world import rotations
from world.character import kinematics
from world.character import model as character
from world.device import at
from world.furniture.piece import Box
from world.objects.furniture_bank import FurnitureBank
from world.scene.box import STAND

#: Body, centre in its frame (z alone, m) and radius, m: the collision shapes as spheres.
_SPHERES = (
    ("pelvis", (0.07,), 0.09),
    ("pelvis", (0.205,), 0.07),
    ("torso", (0.12,), 0.11),
    ("head", (0.175,), 0.095),
    *((f"{side}_upper_arm", (-0.05, -0.14, -0.23), 0.045) for side in ("right", "left")),
    *((f"{side}_lower_arm", (-0.0525, -0.12, -0.1875), 0.04) for side in ("right", "left")),
    *((f"{side}_hand", (0.0,), 0.04) for side in ("right", "left")),
    *((f"{side}_thigh", (-0.06, -0.16, -0.26, -0.36), 0.055) for side in ("right", "left")),
    *((f"{side}_shin", (-0.045, -0.15, -0.25, -0.355), 0.05) for side in ("right", "left")),
)
#: Body of each sphere, [P], and its radius, m: [P].
BODIES = torch.tensor([character.BODIES.index(b) for b, zs, _ in _SPHERES for _ in zs])
_HEIGHTS = torch.tensor([z for _, zs, _ in _SPHERES for z in zs])
RADII = torch.tensor([r for _, zs, r in _SPHERES for _ in zs])
#: All spheres but those of the arms, which close on a box before they hold it.
_ARMS = ("hand", "lower_arm", "upper_arm")
LIMBS = torch.tensor(
    [
        sphere
        for sphere, body in enumerate(BODIES.tolist())
        if not character.BODIES[body].endswith(_ARMS)
    ]
)
#: A limb this deep in a stand throws the character, m.
THROWN_M = 0.015
#: Parts of a stand.
PLATE, COLUMN = STAND.boxes

#: Rows computed at a time: each takes 7 kB, and behaviour cloning from the clips has 70,000.
_ROWS = 2048


def points(qpos: Tensor) -> Tensor:
    """Centres of the character's spheres, world, m: qpos [n, 43] -> [n, P, 3]."""
    local = rotations.matrix(kinematics.local_rotations(qpos))
    position, rotation = kinematics.forward(qpos[:, :3], local)
    bodies, heights = at(BODIES, qpos), at(_HEIGHTS, qpos)
    return position[:, bodies] + rotation[:, bodies, :, 2] * heights[:, None]


def depth(
    centres: Tensor, origin: Tensor, yaw: Tensor, bank: FurnitureBank, variant: Tensor
) -> Tensor:
    """Deepest penetration of the spheres into a piece, m, negative for clearance: [n].

    Args: centres [n, P, 3] world, m; origin [n, 3] m and yaw [n, 2] (cosine, sine) of the piece;
    variant [n] int64, its number in the bank.
    """
    if len(centres) > _ROWS:
        parts = zip(*(x.split(_ROWS) for x in (centres, origin, yaw, variant)), strict=True)
        return torch.cat([depth(c, o, y, bank, v) for c, o, y, v in parts])
    inside = rotations.turn_back(yaw[:, None], centres - origin[:, None])
    offset = inside[:, :, None] - bank.box_centre[variant][:, None]
    # into the boxes' own axes: Rᵀ v for [n, P, S]
    axes = bank.box_rotation[variant][:, None]
    local = (offset[..., None] * axes).sum(dim=-2)
    distance = _distance(local, bank.box_half[variant][:, None])
    distance = torch.where(bank.box_used[variant][:, None], distance, torch.inf)
    return (at(RADII, distance)[:, None] - distance).flatten(1).amax(dim=1)


def _distance(local: Tensor, half: Tensor) -> Tensor:
    """Distance of points [..., 3], in the axes of boxes with these half edges, from the surface, m;
    negative inside."""
    beyond = local.abs() - half
    return beyond.clamp_min(0.0).norm(dim=-1) + beyond.amax(dim=-1).clamp_max(0.0)


def limb_depth(centres: Tensor, pose: Tensor, half: Tensor) -> Tensor:
    """[T]: deepest penetration of the limbs [T, len(LIMBS), 3] into boxes, m, negative for
    clearance; their poses [T or 1, 7] and half edges [3], m."""
    axes = rotations.matrix(pose[:, 3:])[:, None]
    away = centres - pose[:, None, :3]
    distance = _distance((away[..., None] * axes).sum(dim=-2), half)
    return (at(RADII, distance)[LIMBS] - distance).amax(dim=1)


def stand_depth(
    centres: Tensor, rest: Tensor, half_height: Tensor, parts: Sequence[Box] = STAND.boxes
) -> Tensor:
    """[T]: deepest penetration of the limbs [T, len(LIMBS), 3] into parts of stands, m.

    rest [T or 1, 4]: centre (m) and yaw (rad) of the boxes on them; half_height [T or 1]: half the
    boxes' height, m. Negative for clearance.
    """
    yaw = torch.stack((rest[:, 3].cos(), rest[:, 3].sin()), dim=1)
    top = torch.cat((rest[:, :2], (rest[:, 2] - half_height)[:, None]), dim=1)
    found = []
    for part in parts:
        centre = top + torch.tensor(part.centre_m, dtype=top.dtype)
        pose = torch.cat((centre, rotations.from_heading(yaw)), dim=1)
        found.append(limb_depth(centres, pose, torch.tensor(part.half_m, dtype=top.dtype)))
    return torch.stack(found).amax(dim=0)

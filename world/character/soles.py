"""The corners of the soles, and which of them stand on the floor."""

import torch
from torch import Tensor

from world.character import model as character
from world.device import at

#: Ends of a sole ahead of the ankle, half its width, and its depth below, in the foot's frame, m
#: (humanoid.xml).
HEEL_M, TOE_M, HALF_WIDTH_M, ANKLE_M = -0.0435, 0.1335, 0.045, 0.05
#: Corners of a sole in its foot's frame, m.
CORNERS = torch.tensor(
    [(x, y, -ANKLE_M) for x in (HEEL_M, TOE_M) for y in (-HALF_WIDTH_M, HALF_WIDTH_M)]
)
#: The front of a sole in its foot's frame, m.
FRONT_M = (TOE_M, 0.0, -ANKLE_M)
#: Bodies of the feet, right first.
FEET = (character.BODIES.index("right_foot"), character.BODIES.index("left_foot"))
#: A corner lower than this in two consecutive frames stands on the floor, m.
PLANTED_M = 0.02


def corners(position: Tensor, rotation: Tensor) -> Tensor:
    """World positions of the corners [..., 2, 4, 3], right foot first, m.

    Args: position [..., 2, 3], m, and rotation [..., 2, 3, 3] of the feet, world.
    """
    sole = at(CORNERS, rotation).to(rotation.dtype)
    # sums of three: the rounding of a matrix product depends on its number of rows
    turned = (rotation[..., None, :, :] * sole[:, None, :]).sum(dim=-1)
    return turned + position[..., None, :]


def slips(before: Tensor, after: Tensor, hz: float) -> tuple[Tensor, Tensor]:
    """Horizontal speeds of the corners between two frames, m/s, and whether each stands on the
    floor in both; [..., 2, 4, 3] twice -> [..., 2, 4] twice."""
    planted = (before[..., 2] < PLANTED_M) & (after[..., 2] < PLANTED_M)
    return (after - before)[..., :2].norm(dim=-1) * hz, planted

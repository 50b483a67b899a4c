"""What is hidden from the discriminator while a box is in hand."""

import torch
from torch import Tensor

from discriminator.protocols import Holding


def hide(normalised: Tensor, states: Tensor, holding: Holding) -> Tensor:
    """Return normalised states [.., F] with the hidden features at their mean, 0, where both hands
    of `states` [.., F] are at the box."""
    away = states[..., holding.hands] - states[..., None, holding.box]
    held = (away.norm(dim=-1) < holding.within_m).all(dim=-1)
    return torch.where(held[..., None] & holding.hidden, 0.0, normalised)

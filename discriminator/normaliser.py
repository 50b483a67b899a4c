"""The fixed normaliser of the discriminator's input, taken from the mocap once."""

import torch
from torch import Tensor

FLOOR = 1e-2  # least deviation: features that are nearly constant in the clips stay finite
CLIP = 10.0  # deviations; a policy far from all clips must not drive the network to infinity
FIRST_COUNTER = 1_000_000_000  # mocap counter of the fit, far from those of training


def fit(samples: Tensor) -> tuple[Tensor, Tensor]:
    """Mean and deviation [F] of samples [n, F], the deviation floored."""
    double = samples.double()
    deviation = double.std(0, correction=0).clamp(min=FLOOR)
    return double.mean(0).float(), deviation.float()


def normalise(states: Tensor, mean: Tensor, deviation: Tensor) -> Tensor:
    """(states - mean) / deviation, clipped to +-10; states [..., F]."""
    return torch.sub(states, mean).div_(deviation).clamp_(-CLIP, CLIP)

"""Fixed normaliser of the discriminator's input, from mocap samples."""

import torch
from torch import Tensor

FLOOR = 1e-2  # least deviation, for features that are nearly constant in the clips
CLIP = 10.0  # in deviations; bounds the input of a policy that is far from all clips
FIRST_COUNTER = 1_000_000_000  # mocap counter of the fit, far from the counters of training


def fit(samples: Tensor) -> tuple[Tensor, Tensor]:
    """Mean and standard deviation [F] of samples [n, F]; the deviation is at least FLOOR."""
    double = samples.double()
    deviation = double.std(0, correction=0).clamp(min=FLOOR)
    return double.mean(0).float(), deviation.float()


def normalise(states: Tensor, mean: Tensor, deviation: Tensor) -> Tensor:
    """States [..., F] as (states - mean) / deviation, clipped at ±CLIP."""
    return torch.sub(states, mean).div_(deviation).clamp_(-CLIP, CLIP)

"""Fixed normaliser of the discriminator's input, from mocap samples."""

import torch
from torch import Tensor

FLOOR = 1e-2  # least deviation, for features that are nearly constant in the clips
#: Least deviation of features that the clips show coarsely. The tilt of a box is inferred: no clip
#: has any, and boxes in hand are tilted by 0.2 rad (median). A deviation of FLOOR told them apart
#: by nothing else, and holding a box earned a tenth of the style reward of walking.
COARSE_FLOOR = 0.2
CLIP = 10.0  # in deviations; bounds the input of a policy that is far from all clips
FIRST_COUNTER = 1_000_000_000  # mocap counter of the fit, far from the counters of training


def fit(samples: Tensor, coarse: Tensor | None = None) -> tuple[Tensor, Tensor]:
    """Mean and standard deviation [F] of samples [n, F]; the deviation is at least FLOOR, of coarse
    features [F] bool at least COARSE_FLOOR."""
    double = samples.double()
    deviation = double.std(0, correction=0).clamp(min=FLOOR)
    if coarse is not None:
        deviation = torch.where(coarse, deviation.clamp(min=COARSE_FLOOR), deviation)
    return double.mean(0).float(), deviation.float()


def normalise(states: Tensor, mean: Tensor, deviation: Tensor) -> Tensor:
    """States [..., F] as (states - mean) / deviation, clipped at ±CLIP."""
    return torch.sub(states, mean).div_(deviation).clamp_(-CLIP, CLIP)

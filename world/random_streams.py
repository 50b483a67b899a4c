"""Counter-based random streams: the n-th draw of (seed, scene, counter) is a pure function of the
three.

There is no generator state to save, shard or replay: a scene draws the same numbers in every
process. The mixer is SplitMix64 (Steele, Lea, Flood 2014), in wrapping
int64 arithmetic.
"""

import math

import torch
from torch import Tensor

_GAMMA = -7046029254386353131  # 0x9E3779B97F4A7C15 as int64
_MIX_1 = -4658895280553007687  # 0xBF58476D1CE4E5B9
_MIX_2 = -7723592293110705685  # 0x94D049BB133111EB

#: Keys of the purposes, all of them, so that two purposes never share numbers.
ACTION_NOISE, EPISODE, MOCAP, DISTURBED_STEP, DISTURBED_EPISODE = 1, 2, 3, 4, 5
TRIAL, THROWS, MOVES, BOX_TRIAL, CLIP_TRIAL = 101, 102, 103, 104, 105


def _shift(x: Tensor, bits: int) -> Tensor:
    """Logical right shift of int64."""
    return (x >> bits) & ((1 << (64 - bits)) - 1)


def _mix(x: Tensor) -> Tensor:
    x = x + _GAMMA
    x = (x ^ _shift(x, 30)) * _MIX_1
    x = (x ^ _shift(x, 27)) * _MIX_2
    return x ^ _shift(x, 31)


def bits(seed: int, purpose: int, scenes: Tensor, counter: Tensor | int, width: int) -> Tensor:
    """Random int64 [n, width] for scene ids [n] int64 and counters ([n] int64 or one int)."""
    # a 0-dimensional tensor of the CPU meets tensors of any device
    root = _mix(torch.tensor(seed, dtype=torch.int64) * 31 + purpose)
    key = _mix(_mix(scenes.to(torch.int64) + root) + counter)
    column = torch.arange(width, dtype=torch.int64, device=key.device)
    return _mix(key[:, None] + column[None, :] * _GAMMA)


def uniform(seed: int, purpose: int, scenes: Tensor, counter: Tensor | int, width: int) -> Tensor:
    """Uniform draws in [0, 1), float32 [n, width], for scene ids [n] and counters."""
    return _shift(bits(seed, purpose, scenes, counter, width), 40).to(torch.float32) * 2.0**-24


def normal(seed: int, scenes: Tensor, counter: Tensor | int, width: int) -> Tensor:
    """Standard normal draws, float32 [n, width] (Box-Muller), for action noise."""
    half = (width + 1) // 2
    u = uniform(seed, ACTION_NOISE, scenes, counter, 2 * half)
    # 1 − u is in (0, 1]: the logarithm is finite
    radius = torch.sqrt(-2.0 * torch.log(1.0 - u[:, :half]))
    angle = (2.0 * math.pi) * u[:, half:]
    return torch.cat((radius * torch.cos(angle), radius * torch.sin(angle)), dim=1)[:, :width]


def drawn(weight: Tensor, u: Tensor) -> Tensor:
    """Return indices [n] int64, with probabilities in proportion to `weight` [F], from uniform u
    [n]."""
    edges = weight.cumsum(0)
    found = torch.searchsorted(edges, u.double() * edges[-1], right=True)
    # a product that rounds up to the total must not end behind the last weight above 0
    return torch.minimum(found, torch.nonzero(weight > 0)[-1])

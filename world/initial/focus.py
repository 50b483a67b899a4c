"""Objects that recently failed, drawn more often."""

import torch
from torch import Tensor

from world import random_streams


def focused(focus: float, rates: Tensor, number: Tensor) -> Tensor | None:
    """Weights [V] of the objects of a bank, of which a share `focus` in [0, 1] is in proportion to
    the recent failure rates [P] of the counted kinds, number [V] int64, and the rest is even; none
    where all are as likely. A kind without an episode yet, NaN or beyond P, counts as the mean of
    the others."""
    if not focus:
        return None
    rate = torch.full((int(number.max()) + 1,), torch.nan, dtype=torch.float64)
    rate = rate.to(number.device)
    rate[: len(rates)] = rates.to(rate)[: len(rate)]
    rate = rate.nan_to_num(float(rate.nanmean()))[number]
    mean = float(rate.mean())
    return 1.0 - focus + focus * rate / mean if mean > 0.0 else None


def chosen(weight: Tensor | None, count: int, u: Tensor) -> Tensor:
    """Objects [n] int64 of a bank of `count`, drawn by weight [count] from u [n] in [0, 1); none:
    evenly."""
    if weight is not None:
        return random_streams.drawn(weight, u)
    return (u * count).long().clamp_max(count - 1)

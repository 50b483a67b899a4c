"""Adam as the learner uses it, with a state of plain tensors for checkpoints."""

from collections.abc import Iterable

import torch
from torch import Tensor, nn


def adam(parameters: Iterable[nn.Parameter], rate: float) -> torch.optim.Adam:
    """Fused Adam: one pass over the weights, the fastest of torch's three on a CPU."""
    return torch.optim.Adam(parameters, lr=rate, fused=True)


def set_rate(optimiser: torch.optim.Optimizer, rate: float) -> None:
    """Change the learning rate."""
    for group in optimiser.param_groups:
        group["lr"] = rate


def steps_taken(optimiser: torch.optim.Optimizer) -> int:
    """Gradient steps so far."""
    return max((int(entry["step"]) for entry in optimiser.state.values()), default=0)


def adam_state(optimiser: torch.optim.Optimizer) -> dict[str, dict[str, Tensor]]:
    """Moments and step counts by parameter number; empty before the first step."""
    state = optimiser.state_dict()["state"]
    return {str(k): {name: v.clone() for name, v in entry.items()} for k, entry in state.items()}


def load_adam_state(optimiser: torch.optim.Optimizer, state: dict[str, dict[str, Tensor]]) -> None:
    """Restore what `adam_state` gave; rates stay as they are."""
    groups = optimiser.state_dict()["param_groups"]
    entries = {int(k): {name: v.clone() for name, v in entry.items()} for k, entry in state.items()}
    optimiser.load_state_dict({"state": entries, "param_groups": groups})

"""The policy of one task out of a mixture's: its other observations are constant, so that they
become part of the biases."""

from dataclasses import dataclass

from torch import Tensor

from policy.checkpoints.format import State
from policy.model.normaliser import NormaliserConfig, normalise


@dataclass(frozen=True)
class Folding:
    """What one task's scenes observe of a mixture's (state, goal) [D]."""

    columns: Tensor
    """[d] int64: the columns that the task's own (state, goal) has, in its order."""
    constant: Tensor
    """[D]: the values of all others in its scenes."""
    hidden: Tensor
    """[D] bool: columns that the critic alone observes."""


def folded(state: State, folding: Folding, limits: NormaliserConfig) -> State:
    """The `policy` section of a mixture's checkpoint for one task: networks of its own observations
    that compute the same outputs."""
    moments = state["normaliser"]
    std = moments["variance"].sqrt().clamp(min=limits.std_floor).float()
    fixed = normalise(folding.constant, moments["mean"].float(), std, limits.clip)
    fixed[folding.columns] = 0.0
    found = dict(state)
    for network in ("actor", "average", "critic"):
        if network in found:
            seen = fixed if network == "critic" else fixed.masked_fill(folding.hidden, 0.0)
            found[network] = _folded(found[network], folding.columns, seen)
    found["normaliser"] = {name: value[folding.columns] for name, value in moments.items()}
    return found


def _folded(weights: dict[str, Tensor], columns: Tensor, fixed: Tensor) -> dict[str, Tensor]:
    found = dict(weights)
    last = max((k for k in weights if k.endswith(".bias")), key=lambda k: int(k.split(".")[1]))
    for first, bias in (("layers.0.weight", "layers.0.bias"), ("skip.weight", last)):
        if first in weights:
            found[bias] = found[bias] + weights[first] @ fixed.to(weights[first].dtype)
            found[first] = weights[first][:, columns].contiguous()
    return found

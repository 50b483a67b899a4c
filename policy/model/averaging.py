"""Average of the policies of several checkpoints of one run."""

from collections.abc import Mapping, Sequence
from typing import Any

import torch
from torch import Tensor

from policy.errors import CheckpointError
from policy.model.normaliser import Normaliser, NormaliserConfig

_FIRST, _SKIP = "layers.0.", "skip.weight"


def mean_policy(
    policies: Sequence[Mapping[str, Any]],
    limits: NormaliserConfig,
    hidden: Tensor | None = None,
) -> dict[str, Any]:
    """The last of several `policy` sections, its averaged actor replaced by the mean of all.

    Stochastic weight averaging (Izmailov et al. 2018) reduces the noise of the last updates. The
    observation normaliser differs between checkpoints, so each actor is first rewritten as the same
    function under the last one's normaliser.

    limits: clip and floor that the run normalises with. hidden: [d] bool, observations that the
    actor never reads, whose moments must not move its biases.
    Raises CheckpointError where the networks differ in shape.
    """
    if not policies:
        raise CheckpointError("no checkpoints to average")
    last = policies[-1]
    target = _normaliser(last["normaliser"], limits)
    actors = [
        _under(policy["average"], _normaliser(policy["normaliser"], limits), target, hidden)
        for policy in policies
    ]
    shapes = {tuple((name, tuple(t.shape)) for name, t in actor.items()) for actor in actors}
    if len(shapes) > 1:
        raise CheckpointError("the checkpoints to average hold networks of different shapes")
    mean = {
        name: torch.stack([actor[name] for actor in actors]).mean(0).to(value.dtype)
        for name, value in last["average"].items()
    }
    return {**last, "average": mean}


def _normaliser(state: Mapping[str, Tensor], limits: NormaliserConfig) -> Normaliser:
    found = Normaliser(len(state["mean"]), limits)
    found.load_state_dict(dict(state))
    return found


def _under(
    actor: Mapping[str, Tensor], own: Normaliser, target: Normaliser, hidden: Tensor | None
) -> dict[str, Tensor]:
    """Weights, float64, of the same actor under the normaliser `target` (exact up to the clip)."""
    moved = {name: value.double() for name, value in actor.items()}
    weight = moved[_FIRST + "weight"]
    shift = (target.mean - own.mean) / own.std.double()
    if hidden is not None:
        shift = shift.masked_fill(hidden, 0.0)
    scale = target.std.double() / own.std.double()
    moved[_FIRST + "bias"] = moved[_FIRST + "bias"] + weight @ shift
    moved[_FIRST + "weight"] = weight * scale
    if _SKIP in moved:
        biases = [name for name in moved if name.endswith(".bias")]
        head = max(biases, key=lambda name: int(name.split(".")[1]))
        moved[head] = moved[head] + moved[_SKIP] @ shift
        moved[_SKIP] = moved[_SKIP] * scale
    return moved

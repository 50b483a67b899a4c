"""Networks as a beginning for others: for those of another task, where what both observe keeps its
weights, and for wider ones."""

from collections.abc import Iterator, Mapping, Sequence

import torch
from torch import Tensor

from policy.checkpoints.format import Layout, State
from policy.errors import LayoutError
from policy.model.networks import hidden_widths, perceptron

#: How many samples the old task's moments still count for: the new one's soon outweigh them.
_REMEMBERED = 2e5
_FIRST = ("layers.0.weight", "skip.weight")


def adopt(
    state: State, theirs: Layout, mine: Layout, names: Mapping[str, str], where: str
) -> State:
    """The `policy` section of a checkpoint with layout `theirs`, for layout `mine`.

    Observed features are matched by name; `names` says what one of mine is called there. Weights on
    features that the old task lacked are 0, so that the networks begin by doing what they did.

    Raises LayoutError, naming the first difference, where states, actions or widths differ.
    """
    for name in ("features", "actions", "hidden", "skip"):
        if getattr(mine, name) != getattr(theirs, name):
            raise LayoutError(
                f"{where}: its {name} differ from this task's, so that nothing of it carries over:"
                " leave out --init, or choose the same preset, --ppo.hidden and --ppo.skip"
            )
    columns = torch.tensor(list(_columns(theirs, mine, names)))
    known = columns >= 0
    found = dict(state)
    for network in ("actor", "average", "critic"):
        if network in found:
            weights = dict(found[network])
            for name in weights.keys() & set(_FIRST):
                weights[name] = _picked(weights[name].T, columns, known, 0.0).T.contiguous()
            found[network] = weights
    moments = found["normaliser"]
    found["normaliser"] = {
        "mean": _picked(moments["mean"], columns, known, 0.0),
        "variance": _picked(moments["variance"], columns, known, 1.0),
        "count": _picked(moments["count"], columns, known, 0.0).clamp(max=_REMEMBERED),
    }
    values = found["values"]
    found["values"] = {**values, "count": values["count"].clamp(max=_REMEMBERED)}
    return found


def widened(state: State, hidden: Sequence[int], seed: int, where: str) -> State:
    """The `policy` section of a checkpoint for hidden layers of these widths, with networks that do
    what they did: new units see something at random, by the seed, and are not heard yet (after Chen
    et al., "Net2Net", 2016).

    Raises LayoutError where the widths there are are not as many, or one of them is larger.
    """
    found = dict(state)
    for network in ("actor", "average", "critic"):
        if network in found:
            _, _, widths = hidden_widths(found[network])
            narrower = any(a > b for a, b in zip(widths, hidden, strict=False))
            if len(widths) != len(hidden) or narrower:
                raise LayoutError(
                    f"{where}: its hidden widths {widths} cannot become {tuple(hidden)}: choose as"
                    " many layers, none of them narrower"
                )
            # averages go on from the same units
            found[network] = _widened(found[network], hidden, seed)
    return found


def _widened(weights: Mapping[str, Tensor], hidden: Sequence[int], seed: int) -> dict[str, Tensor]:
    inputs, outputs, _ = hidden_widths(weights)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        wide = perceptron(inputs, hidden, outputs, 1.0).state_dict()
    for name, values in wide.items():
        old = weights[f"layers.{name}"]
        if values.dim() == 2:
            # what was there does not hear what is new
            values[: old.shape[0], old.shape[1] :] = 0.0
            values[: old.shape[0], : old.shape[1]] = old
        else:
            values[: old.shape[0]] = old
    return {**weights, **{f"layers.{name}": values for name, values in wide.items()}}


def _columns(theirs: Layout, mine: Layout, names: Mapping[str, str]) -> Iterator[int]:
    """For each number that my networks observe the one of theirs that means the same, or −1."""
    first, start = {}, 0
    for name, width in (*theirs.features, *theirs.goal):
        first[name, width] = start
        start += width
    for name, width in (*mine.features, *mine.goal):
        at = first.get((names.get(name, name), width))
        yield from range(at, at + width) if at is not None else [-1] * width


def _picked(rows: Tensor, columns: Tensor, known: Tensor, default: float) -> Tensor:
    """Rows by index, `default` where it is not known."""
    shape = (-1, *[1] * (rows.dim() - 1))
    return torch.where(known.view(shape), rows[columns.clamp(min=0)], default)

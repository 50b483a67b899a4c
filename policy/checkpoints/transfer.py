"""Transfer of networks to another task, by common features."""

from collections.abc import Iterator, Mapping, Sequence

import torch
from torch import Tensor

from policy.checkpoints.format import Layout, State
from policy.errors import LayoutError

#: Cap on the sample count of the old task's moments, so that the new task soon outweighs them.
_REMEMBERED = 2e5
#: Features of a smaller standard deviation were constant (NormaliserConfig.std_floor).
_CONSTANT = 1e-2
_FIRST = ("layers.0.weight", "skip.weight")


def adopt(
    state: State,
    theirs: Layout,
    mine: Layout,
    names: Mapping[str, str],
    where: str,
    level: Sequence[str] = (),
) -> State:
    """The `policy` section of a checkpoint with layout `theirs`, for layout `mine`.

    Features are matched by name; `names` maps a name of `mine` to the one of `theirs`. Weights on
    features that the old task lacks, or that were constant in it, are 0, so that the networks
    initially compute the same outputs.

    level: positions of `theirs` whose height above the floor never varies (Task.level). Relative to
    the root their z is minus the root's height, up to a constant: their weights on z become weights
    on the root's height, with equal outputs. In the new task, where the height does vary, z would
    be many standard deviations from what the networks know.

    Raises LayoutError, naming the first difference, where states, actions or widths differ.
    """
    for name in ("features", "actions", "hidden", "skip"):
        if getattr(mine, name) != getattr(theirs, name):
            raise LayoutError(
                f"{where}: its {name} differ from this task's, so that nothing of it carries over:"
                " leave out --init, or choose the same preset, --ppo.hidden and --ppo.skip"
            )
    state = _without_heights(state, theirs, level)
    columns = torch.tensor(list(_columns(theirs, mine, names)))
    # what was constant had no influence, and its weights are as they were drawn
    varied = state["normaliser"]["variance"].sqrt() >= _CONSTANT
    known = (columns >= 0) & varied[columns.clamp(min=0)]
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


def _without_heights(state: State, layout: Layout, level: Sequence[str]) -> State:
    starts, start = {}, 0
    for name, width in (*layout.features, *layout.goal):
        starts[name] = start
        start += width
    found = dict(state)
    moments = {name: value.clone() for name, value in found["normaliser"].items()}
    std = moments["variance"].sqrt()
    root = starts.get("root_height", 0)
    for column in (starts[name] + 2 for name in level):
        for network in ("actor", "average", "critic"):
            if network in found:
                weights = dict(found[network])
                for name in weights.keys() & set(_FIRST):
                    moved = weights[name].clone()
                    moved[:, root] -= moved[:, column] * float(std[root] / std[column])
                    moved[:, column] = 0.0
                    weights[name] = moved
                found[network] = weights
        moments["mean"][column], moments["variance"][column] = 0.0, 1.0
        moments["count"][column] = 0.0
    found["normaliser"] = moments
    return found


def _columns(theirs: Layout, mine: Layout, names: Mapping[str, str]) -> Iterator[int]:
    """For each column of the observation of `mine`, its column in `theirs`, or −1."""
    first, start = {}, 0
    for name, width in (*theirs.features, *theirs.goal):
        first[name, width] = start
        start += width
    for name, width in (*mine.features, *mine.goal):
        at = first.get((names.get(name, name), width))
        yield from range(at, at + width) if at is not None else [-1] * width


def _picked(rows: Tensor, columns: Tensor, known: Tensor, default: float) -> Tensor:
    """Rows by index; `default` where `known` is False."""
    shape = (-1, *[1] * (rows.dim() - 1))
    return torch.where(known.view(shape), rows[columns.clamp(min=0)], default)

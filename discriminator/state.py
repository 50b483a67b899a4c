"""Validation of a discriminator's state before it is loaded: names, shapes, number types, finite
values and consistent counters."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from world.errors import LayoutError

LOSS = "style/loss"
"""Figure of trainings that take gradient steps, and of no others."""
MAX_NEW_ROWS = 1 << 22
"""Most transitions of the last rollout."""
MAX_FIGURES = 64
"""Most metrics of a training, and of each scored rollout."""
_COUNTERS = {"seed": 0, "version": 0, "batches": 0, "transitions": 0, "replay": 0,
             "last_batch": -1, "forgotten": -1}  # fmt: skip
_MOMENT = re.compile(r"adam/(\d{1,4})/(step|exp_avg|exp_avg_sq)")
_SCORE = re.compile(r"scores/(\d{1,2})/(.+)")


@dataclass(frozen=True)
class Form:
    """Valid form of the state of one discriminator."""

    tensors: Mapping[str, Tensor]
    """Tensors of the network and the normaliser."""
    parameters: tuple[torch.Size, ...]
    """Shapes of the trained parameters, in the optimiser's order."""
    inputs: int
    """Width of a row of network input."""
    window: int
    """States in a row."""
    capacity: int
    """Capacity of the replay."""
    remembered: int
    """Number of rollouts whose scores are kept."""


def check(state: Mapping[str, Tensor], form: Form) -> None:
    """Raise LayoutError, naming the tensor and its valid form, unless the state fits."""
    for name, own in form.tensors.items():
        _same(state, name, own.dtype, own.shape)
    if not (state["normaliser/deviation"] > 0).all():
        raise _error("normaliser/deviation", "must be above 0")
    counters = _counters(state, form)
    rows = state.get("new")
    if rows is None or rows.ndim != 2 or rows.shape[1] != form.inputs or len(rows) > MAX_NEW_ROWS:
        raise _error("new", f"must be [0 to {MAX_NEW_ROWS}, {form.inputs}]")
    _same(state, "new", torch.float32, rows.shape)
    if "replay" in state:
        shape = torch.Size((counters["replay"], form.inputs))
        _same(state, "replay", torch.float32, shape)
    history = _history(state, form)
    _moments(state, form)
    _figures(state, form)
    known = {*form.tensors, *(f"counters/{name}" for name in _COUNTERS), "new", "replay", *history}
    for name in state:
        if name not in known and not name.startswith(("adam/", "scores/", "trained/")):
            raise _error(name[:80], "is not part of a state")


def _history(state: Mapping[str, Tensor], form: Form) -> tuple[str, ...]:
    """Check the last states of every scene, from which windows longer than 2 go on."""
    if form.window == 2:
        return ()
    past, age, earlier = state.get("past"), state.get("age"), form.window - 2
    if age is None or age.ndim != 1 or len(age) > MAX_NEW_ROWS:
        raise _error("age", f"must be [0 to {MAX_NEW_ROWS}]")
    _same(state, "age", torch.int64, age.shape)
    if past is None:
        raise _error("past", "is missing")
    shape = torch.Size((earlier, len(age), form.inputs // form.window))
    _same(state, "past", torch.float32, shape)
    if ((age < 0) | (age > earlier)).any():
        raise _error("age", f"must be 0 to {earlier}")
    return "past", "age"


def _counters(state: Mapping[str, Tensor], form: Form) -> dict[str, int]:
    found = {}
    for name, least in _COUNTERS.items():
        _same(state, f"counters/{name}", torch.int64, torch.Size(()))
        found[name] = int(state[f"counters/{name}"])
        if found[name] < least:
            raise _error(f"counters/{name}", f"is {found[name]}, must be {least} or more")
    if found["replay"] > form.capacity:
        raise LayoutError(
            f"discriminator state: a replay of {found['replay']}, must be at most {form.capacity}"
        )
    return found


def _moments(state: Mapping[str, Tensor], form: Form) -> None:
    """Check Adam's moments: of all parameters, after the same number of steps, or none where the
    last training, if any, took no step. How many that is depends on the settings of earlier stages
    of a recipe."""
    names = [name for name in state if name.startswith("adam/")]
    for name in names:
        match = _MOMENT.fullmatch(name)
        if match is None or int(match[1]) >= len(form.parameters):
            raise _error(name[:80], "is not part of a state")
    if not names and f"trained/{LOSS}" not in state:
        return
    steps: float | None = None
    for index, shape in enumerate(form.parameters):
        for part in ("exp_avg", "exp_avg_sq"):
            _same(state, f"adam/{index}/{part}", torch.float32, shape)
        if (state[f"adam/{index}/exp_avg_sq"] < 0).any():
            raise _error(f"adam/{index}/exp_avg_sq", "must be 0 or more")
        _same(state, f"adam/{index}/step", torch.float32, torch.Size(()))
        taken = float(state[f"adam/{index}/step"])
        if taken < 1.0 or taken % 1.0:
            raise _error(f"adam/{index}/step", f"is {taken:g}, must be a number of steps")
        steps = taken if steps is None else steps
        if taken != steps:
            raise _error(f"adam/{index}/step", f"is {taken:g}, must be {steps:g} as the others")


def _figures(state: Mapping[str, Tensor], form: Form) -> None:
    """Check the metrics of the last training, and the scores that are kept for a retry."""
    trained = [name for name in state if name.startswith("trained/")]
    scores: dict[int, list[str]] = {}
    for name in (name for name in state if name.startswith("scores/")):
        match = _SCORE.fullmatch(name)
        if match is None or int(match[1]) > form.remembered:
            raise _error(name[:80], "is not part of a state")
        scores.setdefault(int(match[1]), []).append(match[2])
    figures = [*trained]
    for order, names in scores.items():
        _same(state, f"scores/{order}/id", torch.int64, torch.Size((2,)))
        reward = state.get(f"scores/{order}/reward")
        if reward is None or reward.ndim != 2:
            raise _error(f"scores/{order}/reward", "must be [steps, scenes]")
        _same(state, f"scores/{order}/reward", torch.float32, reward.shape)
        if len(names) > MAX_FIGURES:
            raise _error(f"scores/{order}", f"has {len(names)} figures, at most {MAX_FIGURES}")
        figures += [f"scores/{order}/{name}" for name in names if name not in ("id", "reward")]
    if len(trained) > MAX_FIGURES:
        raise _error("trained", f"has {len(trained)} figures, must be at most {MAX_FIGURES}")
    for name in figures:
        _same(state, name, torch.float64, torch.Size(()))


def _same(state: Mapping[str, Tensor], name: str, kind: torch.dtype, shape: torch.Size) -> None:
    if name not in state:
        raise _error(name, "is missing")
    found = state[name]
    if found.shape != shape:
        raise _error(name, f"is {list(found.shape)}, must be {list(shape)}")
    if found.dtype != kind:
        short = str(kind).removeprefix("torch.")
        raise _error(name, f"is {str(found.dtype).removeprefix('torch.')}, must be {short}")
    if kind.is_floating_point and not found.isfinite().all():
        raise _error(name, "holds numbers that are not finite")


def _error(name: str, text: str) -> LayoutError:
    return LayoutError(f"discriminator state: {name} {text}")

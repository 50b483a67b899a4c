"""Which values of a dimension belong to training pieces and which to test pieces.

A range is cut into five cells, dealt in turn: train, test, train, test, train. A tenth of a cell is
left out at each end of a cell, so no test piece shares a value of any drawn dimension with a
training piece, and yet lies within the range that training covers.
"""

from collections.abc import Mapping, Sequence
from typing import Literal, TypeVar

import numpy as np

from world.errors import ChoiceError

Split = Literal["train", "test"]
Range = tuple[float, float]
T = TypeVar("T")

SPLITS: tuple[Split, ...] = ("train", "test")
CELLS = 5
MARGIN = 0.1
"""Share of a cell left out at each of its ends."""


def cells(span: Range, split: Split) -> tuple[Range, ...]:
    """The stretches of `span` that belong to `split`. Raises ChoiceError for an unknown split."""
    if split not in SPLITS:
        raise ChoiceError("split", split, list(SPLITS))
    low, high = span
    width = (high - low) / CELLS
    return tuple(
        (low + (i + MARGIN) * width, low + (i + 1 - MARGIN) * width)
        for i in range(SPLITS.index(split), CELLS, len(SPLITS))
    )


def draw(rng: np.random.Generator, split: Split, ranges: Mapping[str, Range]) -> dict[str, float]:
    """A value for each named range, uniform over the cells of the split, independent."""
    values: dict[str, float] = {}
    for name, span in ranges.items():
        own = cells(span, split)
        low, high = own[int(rng.integers(len(own)))]
        values[name] = float(rng.uniform(low, high))
    return values


def choose(rng: np.random.Generator, options: Sequence[T], turn: int | None) -> T:
    """The option whose turn it is, so that a few pieces show them all; without a turn, any."""
    return options[int(rng.integers(len(options))) if turn is None else turn % len(options)]

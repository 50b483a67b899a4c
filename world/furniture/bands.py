"""The split of drawn dimensions between training and test pieces.

A range has five cells: train, test, train, test, train. A tenth of a cell is left out at each of
its ends, so that a test piece has no drawn dimension in common with a training piece, but is within
the range of training.
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
"""Fraction of a cell that is left out at each of its ends."""


def cells(span: Range, split: Split) -> tuple[Range, ...]:
    """The cells of `span` of a split, without their margins. Raises ChoiceError for an unknown
    split."""
    if split not in SPLITS:
        raise ChoiceError("split", split, list(SPLITS))
    low, high = span
    width = (high - low) / CELLS
    return tuple(
        (low + (i + MARGIN) * width, low + (i + 1 - MARGIN) * width)
        for i in range(SPLITS.index(split), CELLS, len(SPLITS))
    )


def draw(rng: np.random.Generator, split: Split, ranges: Mapping[str, Range]) -> dict[str, float]:
    """A value for each named range, independent and uniform over the cells of the split."""
    values: dict[str, float] = {}
    for name, span in ranges.items():
        own = cells(span, split)
        low, high = own[int(rng.integers(len(own)))]
        values[name] = float(rng.uniform(low, high))
    return values


def choose(rng: np.random.Generator, options: Sequence[T], turn: int | None) -> T:
    """The option number `turn` in rotation, so that a few pieces have them all; None: a random
    one."""
    return options[int(rng.integers(len(options))) if turn is None else turn % len(options)]

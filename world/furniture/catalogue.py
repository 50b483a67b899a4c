"""The catalogue of the package's own furniture, by class, split and number."""

import re
import zlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import count as counting

import numpy as np

from world.errors import ChoiceError, PieceError
from world.furniture import armchair, bed, chair, sofa, stool, table
from world.furniture.bands import SPLITS, Split
from world.furniture.piece import Piece
from world.furniture.usage import usage

Sampler = Callable[[np.random.Generator, Split, int], Piece]
"""(random stream, split, turn: number of the construction, in rotation) -> piece."""

REGISTRY: dict[str, Sampler] = {
    "chair": chair.sample,
    "armchair": armchair.sample,
    "low-stool": stool.sample_low,
    "high-stool": stool.sample_high,
    "sofa": sofa.sample,
    "bed": bed.sample,
    "table": table.sample,
}
"""Class -> generator. A new class is one file and one line here."""

SEATS = ("chair", "armchair", "low-stool", "high-stool")
"""Default classes of `catalogue`."""

COUNTS: dict[Split, int] = {"train": 60, "test": 12}
"""Default number of pieces of each split."""

WHOLE: dict[Split, int] = {"train": 350, "test": 60}
"""Number of pieces of each split of `whole`."""

_MOST_SKIPPED = 200
"""Consecutive pieces of a class without an affordance after which the class has none."""


def catalogue(
    split: Split,
    count: int | None = None,
    seed: int = 0,
    classes: tuple[str, ...] | None = None,
    affordance: str | None = None,
) -> tuple[Piece, ...]:
    """The first `count` pieces of a split, with the classes in rotation, so that any count is
    balanced.

    The classes are those given, else those of the affordance, else SEATS; pieces without the
    affordance are skipped. Piece i of a class depends on (seed, class, split, i) alone:
    a longer catalogue begins with a shorter one. Raises ChoiceError for an unknown class, split or
    affordance, PieceError for a class of which none has the affordance.
    """
    names = classes or (SEATS if affordance is None else usage(affordance).classes)
    total = COUNTS.get(split, 0) if count is None else count
    _check_choice("split", split, list(SPLITS))
    turns = [_affording(name, split, seed, affordance) for name in names]
    return tuple(next(turns[i % len(names)]) for i in range(total))


def whole(split: Split, seed: int = 0) -> tuple[Piece, ...]:
    """All WHOLE pieces of a split, of all seven classes."""
    _check_choice("split", split, list(SPLITS))
    return catalogue(split, WHOLE[split], seed, tuple(REGISTRY))


def find(name: str, seed: int = 0) -> Piece:
    """The piece of a name such as `chair-train-007`.

    Raises ChoiceError for an unknown class or split, PieceError for a name of another form.
    """
    parts = re.fullmatch(r"([\w-]+)-([a-z]+)-(\d+)", name)
    if parts is None:
        raise PieceError(
            f"no piece '{name}': a name is CLASS-SPLIT-NUMBER, as chair-train-007; "
            f"choose a class of {', '.join(sorted(REGISTRY))} and a split of {', '.join(SPLITS)}"
        )
    category, split, index = parts.groups()
    _check_choice("split", split, list(SPLITS))
    return _piece(category, "train" if split == "train" else "test", int(index), seed)


def _affording(category: str, split: Split, seed: int, affordance: str | None) -> Iterator[Piece]:
    """The pieces of a class in order, with an affordance only those that have it."""
    skipped = 0
    for index in counting():
        piece = _piece(category, split, index, seed)
        if affordance is None or usage(affordance).use_points(piece):
            skipped = 0
            yield piece
        elif (skipped := skipped + 1) > _MOST_SKIPPED:
            raise PieceError(f"no {category} has a place to {affordance}")


def _piece(category: str, split: Split, index: int, seed: int) -> Piece:
    _check_choice("furniture class", category, list(REGISTRY))
    # The class enters by its name, so that adding one changes no piece of another.
    key = (seed, zlib.crc32(category.encode()), SPLITS.index(split), index)
    piece = REGISTRY[category](np.random.default_rng(key), split, index)
    return replace(piece, name=f"{category}-{split}-{index:03d}", seed=seed)


def _check_choice(kind: str, name: str, choices: list[str]) -> None:
    if name not in choices:
        raise ChoiceError(kind, name, choices)

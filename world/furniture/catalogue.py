"""The furniture that characters train and are tested on, found by class, split and number."""

import re
import zlib
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from world.errors import ChoiceError, PieceError
from world.furniture import armchair, chair, stool
from world.furniture.bands import SPLITS, Split
from world.furniture.piece import Piece

Sampler = Callable[[np.random.Generator, Split, int], Piece]
"""(random stream, split, turn: which of its constructions, in rotation) -> piece."""

REGISTRY: dict[str, Sampler] = {
    "chair": chair.sample,
    "armchair": armchair.sample,
    "low-stool": stool.sample_low,
    "high-stool": stool.sample_high,
}
"""Class -> generator. A new class is one file and one line here."""

COUNTS: dict[Split, int] = {"train": 60, "test": 12}
"""Pieces of each split where the caller does not say."""


def catalogue(
    split: Split,
    count: int | None = None,
    seed: int = 0,
    classes: tuple[str, ...] | None = None,
) -> tuple[Piece, ...]:
    """The first `count` pieces of a split, the classes taking turns, so that any count is balanced.

    Piece i of a class depends on (seed, class, split, i) alone: a longer catalogue begins with a
    shorter one. Raises ChoiceError for an unknown class or split.
    """
    names = tuple(REGISTRY) if classes is None else classes
    total = COUNTS.get(split, 0) if count is None else count
    _known("split", split, list(SPLITS))
    return tuple(_piece(names[i % len(names)], split, i // len(names), seed) for i in range(total))


def find(name: str, seed: int = 0) -> Piece:
    """The piece called, say, `chair-train-007`.

    Raises ChoiceError for an unknown class or split, PieceError for a name of another form.
    """
    parts = re.fullmatch(r"([\w-]+)-([a-z]+)-(\d+)", name)
    if parts is None:
        raise PieceError(
            f"no piece '{name}': a name is CLASS-SPLIT-NUMBER, as chair-train-007; "
            f"choose a class of {', '.join(sorted(REGISTRY))} and a split of {', '.join(SPLITS)}"
        )
    category, split, index = parts.groups()
    _known("split", split, list(SPLITS))
    return _piece(category, "train" if split == "train" else "test", int(index), seed)


def _piece(category: str, split: Split, index: int, seed: int) -> Piece:
    _known("furniture class", category, list(REGISTRY))
    # The class enters by its name, so that adding one changes no piece of another.
    key = (seed, zlib.crc32(category.encode()), SPLITS.index(split), index)
    piece = REGISTRY[category](np.random.default_rng(key), split, index)
    return replace(piece, name=f"{category}-{split}-{index:03d}", seed=seed)


def _known(kind: str, name: str, choices: list[str]) -> None:
    if name not in choices:
        raise ChoiceError(kind, name, choices)

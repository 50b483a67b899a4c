"""What a shard needs of its objects, whatever they are."""

from collections.abc import Sequence
from typing import Protocol

import mujoco

from world.furniture.piece import Piece


class ObjectBank(Protocol):
    """V variants of an object, each with a model of its scene; a shard swaps them."""

    @property
    def models(self) -> list[mujoco.MjModel]:
        """[V]."""
        ...

    @property
    def pieces(self) -> Sequence[Piece]:
        """[V]: what a recording shows of each."""
        ...

    def __len__(self) -> int:
        """V."""
        ...

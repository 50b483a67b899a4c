"""The protocol of banks of objects."""

from collections.abc import Sequence
from typing import Protocol

import mujoco

from world.furniture.piece import Piece


class ObjectBank(Protocol):
    """V variants of an object, each with the model of its scene; a shard exchanges them."""

    @property
    def models(self) -> list[mujoco.MjModel]:
        """[V]: models of the scenes."""
        ...

    @property
    def pieces(self) -> Sequence[Piece]:
        """[V]: pieces that a recording shows."""
        ...

    def __len__(self) -> int:
        """Number of variants V."""
        ...

"""The protocol of banks of objects."""

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

import mujoco
from torch import Tensor

from world.furniture.piece import Piece
from world.scene.batch import Scenes
from world.scene.target import Target


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


@runtime_checkable
class MovableBank(Protocol):
    """A bank whose objects can be moved during an episode."""

    def move(
        self,
        scenes: Scenes,
        ids: Tensor,
        variant: Tensor,
        target: Target,
        point: Tensor,
        facing: Tensor,
    ) -> Target:
        """Move the objects `variant` [m] of the scenes `ids` [m], whose present targets are
        `target` [m], to floor points [m, 2] m with facings [m, 2] (cosine, sine); returns the new
        targets [m]."""
        ...

"""What a shard needs of the initial states of its episodes, whatever the object."""

from typing import Protocol, TypeVar

from torch import Tensor

from world.scene.batch import Scenes
from world.scene.target import Target


class InitialStateBatch(Protocol):
    """First states of m episodes; read only."""

    @property
    def qpos(self) -> Tensor:
        """[m, 43]."""
        ...

    @property
    def qvel(self) -> Tensor:
        """[m, 34]."""
        ...

    @property
    def variant(self) -> Tensor:
        """[m] int64: the object, by number in the bank."""
        ...

    @property
    def kind(self) -> Tensor:
        """[m] int64: index into world.initial.reference.KINDS."""
        ...

    @property
    def frame(self) -> Tensor:
        """[m] int64: the state's frame in the motion library; −1 for the rest pose."""
        ...


States = TypeVar("States", bound=InitialStateBatch)


class InitialStateSampler(Protocol[States]):
    """Draws states and sets scenes up with them."""

    def draw(self, scenes: Tensor, episodes: Tensor) -> States: ...
    def target(self, states: States) -> Target: ...
    def apply(self, scenes: Scenes, ids: Tensor, states: States) -> None: ...
    def load_n(self, states: States) -> tuple[Tensor, Tensor]: ...

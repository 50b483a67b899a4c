"""Protocols of initial states and their samplers, for any object."""

from collections.abc import Mapping
from typing import Protocol, TypeVar, runtime_checkable

from torch import Tensor

from world.scene.batch import Scenes
from world.scene.target import Target


class InitialStateBatch(Protocol):
    """Initial states of m episodes; read only."""

    @property
    def qpos(self) -> Tensor:
        """[m, 43]: generalised coordinates of the characters."""
        ...

    @property
    def qvel(self) -> Tensor:
        """[m, 34]: generalised velocities of the characters."""
        ...

    @property
    def variant(self) -> Tensor:
        """[m] int64: the object, by number in the bank."""
        ...

    @property
    def kind(self) -> Tensor:
        """[m] int64: category, index into world.initial.reference.KINDS."""
        ...

    @property
    def frame(self) -> Tensor:
        """[m] int64: the state's frame in the motion library; −1 for the rest pose."""
        ...


States = TypeVar("States", bound=InitialStateBatch)


class InitialStateSampler(Protocol[States]):
    """Draws initial states and writes them into scenes."""

    def draw(self, scenes: Tensor, episodes: Tensor) -> States:
        """Initial states for scene ids [m] and episode numbers [m] (int64 both)."""
        ...

    def target(self, states: States) -> Target:
        """Targets [m] of `states`."""
        ...

    def apply(self, scenes: Scenes, ids: Tensor, states: States) -> None:
        """Write `states` into the scenes `ids` [m]."""
        ...

    def load_n(self, states: States) -> tuple[Tensor, Tensor]:
        """Force of each hand on an object in hand, and the weight that both bear, N: [m] each."""
        ...


@runtime_checkable
class AdaptiveSampler(Protocol):
    """A sampler that draws more initial states where episodes failed."""

    def update_sampling(self, published: Mapping[str, Tensor]) -> None:
        """Take what the learner publishes: `failures` [S], recent ones by segment of the reference
        motions, and `piece_sit` [P] and the like, recent failure rates of the pieces of a usage or
        of groups of boxes."""
        ...

    def episode_records(self, variant: Tensor, kind: Tensor) -> dict[str, Tensor]:
        """What ended episodes tell the learner for it, by name, [k] each; variant, kind [k] as of
        their initial states."""
        ...


@runtime_checkable
class Placed(Protocol):
    """Initial states whose object can be moved during an episode."""

    @property
    def place(self) -> tuple[Tensor, Tensor]:
        """Floor point [m, 2] m of the object and its facing [m, 2], which a move begins from."""
        ...

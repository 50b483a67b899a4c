"""The starter of a task, by what its objects offer."""

from typing import Protocol, TypeVar

from torch import Tensor

from world.config import WorldConfig
from world.initial.box import BoxStarter
from world.initial.furniture import Starter
from world.initial.track import TrackStarter
from world.motions.library import MotionLibrary
from world.objects.box_bank import BoxBank
from world.objects.furniture_bank import Bank
from world.objects.track_bank import TrackBank
from world.scene.batch import Scenes
from world.tasks.task import Place


class Starts(Protocol):
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


Drawn = TypeVar("Drawn", bound=Starts)


class AnyStarter(Protocol[Drawn]):
    """Draws starts and sets scenes up with them."""

    def draw(self, scenes: Tensor, episodes: Tensor) -> Drawn: ...
    def place(self, starts: Drawn) -> Place: ...
    def put(self, scenes: Scenes, ids: Tensor, starts: Drawn) -> None: ...
    def load_n(self, starts: Drawn) -> tuple[Tensor, Tensor]: ...


def make(
    config: WorldConfig, library: MotionLibrary, bank: Bank | BoxBank | TrackBank, seed: int
) -> AnyStarter[Starts]:
    """The starter of the bank's objects."""
    if isinstance(bank, TrackBank):
        return TrackStarter(config, bank, seed)  # pyright: ignore[reportReturnType]
    if isinstance(bank, BoxBank):
        return BoxStarter(config, library, bank, seed)  # pyright: ignore[reportReturnType]
    return Starter(config, library, bank, seed)  # pyright: ignore[reportReturnType]

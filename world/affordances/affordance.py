"""The base class of affordances: training objects, initial states, trials, and the use of clips."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import mujoco
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from world.character import model as character
from world.config import WorldConfig
from world.furniture.piece import Piece
from world.initial.sampler import InitialStateSampler
from world.motions.library import MotionLibrary
from world.motions.uses.use import ClipUse
from world.objects.bank import ObjectBank
from world.scene.batch import Scenes
from world.scene.perturbations import Disturbance
from world.scene.target import Target
from world.tracking.arrivals import Arrivals
from world.tracking.rollouts import Rollouts


@dataclass(frozen=True)
class Setting:
    """Positions of the objects of n trials about their characters, which are at the origin."""

    pieces: Sequence[Piece]
    """[n]: pieces, scaled."""
    disturbance: Disturbance
    point: Tensor
    """[n, 2]: the floor below the use point, m."""
    facing: Tensor
    """[n, 2]: cosine and sine of the use point's facing."""
    trials: NDArray[np.int64]
    """[n]: numbers of the trials."""
    seed: int
    """Seed of the trials."""
    target_m: tuple[float, float]
    """Least and greatest distance of a moved object's target from its initial position, m."""


class Arrangement(Protocol):
    """The objects of n trials."""

    models: list[mujoco.MjModel]
    """[n]: models of the scenes."""

    @property
    def bank(self) -> ObjectBank:
        """[n]: the objects."""
        ...

    @property
    def point(self) -> Tensor:
        """[n, 2]: the setting's points, m; further away where the character would stand in the
        object."""
        ...

    def begin(self, scenes: Scenes) -> Target:
        """Write the initial state of objects and standing characters; returns the targets [n]."""
        ...

    def move(self, scenes: Scenes, ids: Tensor, point: Tensor, facing: Tensor) -> Target:
        """Move the objects of the scenes `ids` [m] to points [m, 2] m with facings [m, 2]; returns
        the new targets [m]."""
        ...


@dataclass(frozen=True)
class ClipStates:
    """Reference states, each with furniture that fits it."""

    models: list[mujoco.MjModel]
    """[n]: models of the scenes."""
    qpos: Tensor
    """[n, 43]."""
    origin: Tensor
    """[n, 3]: of the furniture, m."""
    yaw: Tensor
    """[n, 2]: cosine and sine of its yaw."""


#: Settings of furniture alone.
FURNITURE_SETTINGS = frozenset(
    {"objects", "pieces", "scales", "scale", "seed", "teacher"}
    | {"initial.raised_seat_fraction", "initial.front_m", "initial.focus"}
)


class Affordance(ABC):
    """The record of one affordance."""

    name: str
    """A verb, for messages: what pieces have a target to do."""
    kind: str
    """Category of the object. The registries policy/objects and console/kinds use it for messages,
    flags and pages."""
    clips: ClipUse
    """Use of clips."""
    cargo: bool = False
    """Whether a free box follows the character's coordinates in a scene."""
    follows_clips: bool = False
    """Whether the task follows clips: evaluation, player and videos then show clips instead of
    trials with objects."""
    unused: frozenset[str] = FURNITURE_SETTINGS
    """Settings of WorldConfig, `initial.` ones included, that change nothing for such a task"""

    classes: tuple[str, ...] = ()
    """Classes of the package's furniture that a new training has; empty: those of the usage, or
    none."""

    @abstractmethod
    def pieces(self, config: WorldConfig) -> tuple[tuple[Piece, ...], str]:
        """Training furniture, empty where the task makes its own objects, and a line on the pieces
        that cannot be used, or an empty one. Raises PieceError or ConfigError."""

    @abstractmethod
    def bank(self, config: WorldConfig) -> ObjectBank:
        """The bank of training objects."""

    def showing(self, config: WorldConfig, bank: ObjectBank, use: ClipUse) -> ObjectBank:
        """The bank for scenes that show the goal of another task, which uses clips as `use` does:
        `bank` itself unless the task follows clips. Raises ClipError where no clip has that
        use."""
        return bank

    def joined_from(
        self, bank: ObjectBank, arrivals: Arrivals | None, rollouts: Rollouts | None
    ) -> ObjectBank:
        """The bank itself; where clips are followed, one of whose clips some begin in the states of
        `arrivals` and of `rollouts`."""
        return bank

    @abstractmethod
    def sampler(
        self, config: WorldConfig, library: MotionLibrary, bank: ObjectBank, seed: int
    ) -> InitialStateSampler:
        """Sampler of initial states; bank: what `bank` returns."""

    @abstractmethod
    def trial_pieces(
        self, objects: str, trials: int, seed: int, config: WorldConfig
    ) -> tuple[Piece, ...]:
        """Pieces that `trials` trials use in turn; objects: `test`, `train`, or a path of
        pieces."""

    @abstractmethod
    def arrange(self, setting: Setting) -> Arrangement:
        """The arrangement of trials."""

    @abstractmethod
    def choices(self, objects: str) -> dict[str, Piece]:
        """Pieces that the player offers, by name, unscaled."""

    @abstractmethod
    def sized(self, piece: Piece, scale: float) -> Piece:
        """A trial's piece at its scale."""

    def chosen(self, piece: Piece, scale: float) -> Piece:
        """A player's piece at its scale."""
        return self.sized(piece, scale)

    def use_point_count(self, piece: Piece) -> int:
        """Number of use points of a piece."""
        return 1

    def clip_states(
        self,
        config: WorldConfig,
        library: MotionLibrary,
        pieces: Sequence[Piece],
        seed: int,
        n: int,
    ) -> ClipStates | None:
        """n reference states with furniture as initial states have it, since the clips' own was not
        recorded. None where the character touches no furniture."""
        return None


def stand(scenes: Scenes, origin: Tensor, yaw: Tensor) -> None:
    """Write characters that stand at the origin with heading 0, and the furniture's origin [n, 3] m
    and yaw [n, 2] (cosine, sine)."""
    every = torch.arange(scenes.n)
    qpos = torch.from_numpy(character.standing_qpos()).expand(scenes.n, -1)
    qvel = torch.zeros(scenes.n, character.NV, dtype=torch.float64)
    scenes.set_state(every, qpos, qvel, origin, yaw)

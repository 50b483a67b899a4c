"""What a task needs of its object: training objects, initial states, trials, what clips teach."""

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


@dataclass(frozen=True)
class Setting:
    """Where the objects of n trials stand about their characters, which are at the origin."""

    pieces: Sequence[Piece]
    """[n], at their scales."""
    disturbance: Disturbance
    point: Tensor
    """[n, 2]: the point of use, on the floor, m."""
    facing: Tensor
    """[n, 2]: cosine and sine of its facing."""
    trials: NDArray[np.int64]
    """[n]: their numbers."""
    seed: int
    """That they are drawn from."""
    target_m: tuple[float, float]
    """Nearest and farthest goal of an object that is moved, from where it is at first, m."""


class Arrangement(Protocol):
    """The objects of n trials."""

    models: list[mujoco.MjModel]
    """[n]."""

    def begin(self, scenes: Scenes) -> Target:
        """Put objects and standing characters where they begin."""
        ...

    def move(self, scenes: Scenes, ids: Tensor, point: Tensor, facing: Tensor) -> Target:
        """Put the objects of the scenes `ids` [m] elsewhere: points [m, 2] m, facings [m, 2]; the
        targets then."""
        ...


@dataclass(frozen=True)
class ClipStates:
    """States of clips, each with furniture that fits it."""

    models: list[mujoco.MjModel]
    """[n]."""
    qpos: Tensor
    """[n, 43]."""
    origin: Tensor
    """[n, 3]: of the furniture, m."""
    yaw: Tensor
    """[n, 2]: its cosine and sine."""


class Affordance(ABC):
    """The record of one kind of object."""

    name: str
    """A verb, for messages: what pieces have a place to do."""
    kind: str
    """By this the policy and the console know how to write such an object into messages, flags and
    pages (their registries: policy/objects, console/kinds)."""
    clips: ClipUse
    """How clips are learned from."""
    cargo: bool = False
    """Whether a free box follows the character's coordinates in a scene."""

    @abstractmethod
    def pieces(self, config: WorldConfig) -> tuple[tuple[Piece, ...], str]:
        """The furniture to train on, none where the task makes its own objects; and a line on what
        of it cannot be used, if anything. Raises PieceError or ConfigError."""

    @abstractmethod
    def bank(self, config: WorldConfig) -> ObjectBank:
        """The training objects, compiled."""

    @abstractmethod
    def sampler(
        self, config: WorldConfig, library: MotionLibrary, bank: ObjectBank, seed: int
    ) -> InitialStateSampler:
        """What draws the initial states; `bank`: as `bank` makes it."""

    @abstractmethod
    def trial_pieces(
        self, objects: str, trials: int, seed: int, config: WorldConfig
    ) -> tuple[Piece, ...]:
        """What `trials` trials use in turn; `objects`: `test`, `train`, or a path of pieces."""

    @abstractmethod
    def arrange(self, setting: Setting) -> Arrangement:
        """The objects of trials."""

    @abstractmethod
    def choices(self, objects: str) -> dict[str, Piece]:
        """What a player can choose from, by name, unscaled."""

    @abstractmethod
    def sized(self, piece: Piece, scale: float) -> Piece:
        """A trial's piece at its scale."""

    def chosen(self, piece: Piece, scale: float) -> Piece:
        """A player's piece at its scale."""
        return self.sized(piece, scale)

    def use_point_count(self, piece: Piece) -> int:
        """How many points of use a piece offers."""
        return 1

    def clip_states(
        self,
        config: WorldConfig,
        library: MotionLibrary,
        pieces: Sequence[Piece],
        seed: int,
        n: int,
    ) -> ClipStates | None:
        """n states of clips with the furniture that initial states would put to them: the clips'
        own was not recorded. None where the character touches no furniture."""
        return None


def stand(scenes: Scenes, origin: Tensor, yaw: Tensor) -> None:
    """Characters standing at the origin with heading 0, furniture about them."""
    every = torch.arange(scenes.n)
    qpos = torch.from_numpy(character.standing_qpos()).expand(scenes.n, -1)
    qvel = torch.zeros(scenes.n, character.NV, dtype=torch.float64)
    scenes.set_state(every, qpos, qvel, origin, yaw)

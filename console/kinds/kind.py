"""What the player, recordings and flags need of a kind of object."""

from collections.abc import Sequence
from typing import Protocol

import mujoco

from console.commands import Synthesize
from console.kinds.setup import Pose, Setup
from console.recording.format import Take
from rpc.v1 import policy_pb2 as pb
from world.config import CarryConfig
from world.furniture.piece import Piece
from world.scene.batch import Scenes
from world.scene.model import Ball
from world.scene.target import Target
from world.tasks import Task


class Object(Protocol):
    """What the character of the player uses."""

    model: mujoco.MjModel

    def begin(self, scenes: Scenes) -> None:
        """Put everything where the setup has it; the character is not touched."""
        ...

    def move(self, scenes: Scenes, goal: Pose) -> None:
        """Put the goal elsewhere: the furniture, or the stand that the box goes to."""
        ...

    def target(self, scenes: Scenes) -> Target:
        """What the task must know of it now."""
        ...


class Kind(Protocol):
    """One kind of object."""

    pictured: bool
    """Whether its pieces are furniture, of which a report shows pictures."""

    def played(
        self, setup: Setup, piece: Piece, task: Task, carry: CarryConfig, balls: Sequence[Ball]
    ) -> Object:
        """The object of a player's setup, compiled. carry: sizes of stands."""
        ...

    def recorded(self, take: Take, task: Task) -> Target:
        """What the task of a take must know of its object, frame by frame; InhabitError where the
        take does not tell."""
        ...

    def requested(
        self, command: Synthesize, task: Task, request: pb.SynthesizeRequest
    ) -> Piece | None:
        """Write what the flags of a command say of the object into its request; the furniture at
        its scale, None where there is none. Raises ConfigError, which names the flag."""
        ...

    def shown(self, piece: Piece) -> Piece:
        """The piece whose boxes stand where a recording's furniture is."""
        ...

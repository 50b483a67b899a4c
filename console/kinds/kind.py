"""Protocols of a kind of object, for the player, recordings and flags."""

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

#: Fields of `synthesize` that only some kinds of object use.
OBJECT_FLAGS = ("object", "place", "scale", "to", "stand_m", "box_kg")


class Object(Protocol):
    """The object in a scene of the player."""

    model: mujoco.MjModel

    def begin(self, scenes: Scenes) -> None:
        """Place the object by the setup; the character does not change."""
        ...

    def move(self, scenes: Scenes, goal: Pose) -> None:
        """Move the furniture, or the target stand of the box, to a pose."""
        ...

    def target(self, scenes: Scenes) -> Target:
        """Return the present target of the task."""
        ...


class Kind(Protocol):
    """One kind of object."""

    pictured: bool
    """True for furniture, of which a report shows pictures."""
    flags: frozenset[str]
    """Fields of `synthesize` about the object that this kind uses, of OBJECT_FLAGS."""

    def played(
        self, setup: Setup, piece: Piece, task: Task, carry: CarryConfig, balls: Sequence[Ball]
    ) -> Object:
        """Return the compiled object of a player's setup. carry: heights of the stands."""
        ...

    def recorded(self, take: Take, task: Task) -> Target:
        """Return the targets of a take's frames; InhabitError where the take lacks them."""
        ...

    def requested(
        self, command: Synthesize, task: Task, request: pb.SynthesizeRequest
    ) -> Piece | None:
        """Write the object of a command's flags into its request; return the scaled furniture, or
        None. Raises ConfigError, which names the flag."""
        ...

    def shown(self, piece: Piece) -> Piece:
        """Return the piece that a recording shows as furniture."""
        ...

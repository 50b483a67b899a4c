"""Reference motions in the player, in recordings and in flags: none of them chooses a clip."""

from collections.abc import Sequence
from typing import NoReturn

from console.commands import Synthesize
from console.kinds.kind import OBJECT_FLAGS
from console.kinds.setup import Setup
from console.recording.format import Take
from rpc.v1 import policy_pb2 as pb
from world.config import CarryConfig
from world.errors import ConfigError
from world.furniture.piece import Piece
from world.scene.model import Ball
from world.tasks import Task


class ReferenceKind:
    """The kind of reference motions; see Kind."""

    pictured = False
    flags: frozenset[str] = frozenset(OBJECT_FLAGS)

    def played(
        self, setup: Setup, piece: Piece, task: Task, carry: CarryConfig, balls: Sequence[Ball]
    ) -> NoReturn:
        """ConfigError: recorded trials are shown instead."""
        raise ConfigError(f"'{task.name}' follows clips: play its run alone")

    def recorded(self, take: Take, task: Task) -> NoReturn:
        """ConfigError: a take has the poses of the reference, but not its set-points and boxes."""
        raise ConfigError("a recording does not hold the whole reference motion")

    def requested(self, command: Synthesize, task: Task, request: pb.SynthesizeRequest) -> NoReturn:
        """ConfigError: requests hold no clips."""
        raise ConfigError(f"'{task.name}' follows clips: use evaluate --record or video")

    def shown(self, piece: Piece) -> Piece:
        """The support of a clip."""
        return piece

"""The room as a source of the player: its moments, measures and status."""

from typing import NoReturn

import numpy as np

from console.demo.room import GOAL_M, Room, RoomMoment, Stage
from console.play.frames import Frames
from console.play.source import Curves
from policy.checkpoints import lineage
from world.errors import ConfigError


class RoomFrames(Frames[RoomMoment]):
    """A room and its last five minutes; a Source."""

    def __init__(self, room: Room) -> None:
        super().__init__(room, rolling=True)
        self.room = room

    def curves(self) -> Curves:
        """See Source; errors are in units of each task's limit, times GOAL_M. No fall ends a
        room."""
        return Curves(
            error_m=np.array([moment.error_m for moment in self.moments]),
            success_m=GOAL_M,
            fell=np.zeros(len(self.moments), np.bool_),
            missing="the distance is scaled so that every task's limit is the dashed line",
        )

    def take(self) -> NoReturn:
        """ConfigError: a recording holds one piece."""
        raise ConfigError("a recording holds one piece: save the room as a page")

    def status(self, frame: int) -> str:
        """See Source."""
        control = self.moments[frame].control
        words = f"**{control.goal.label}**"
        if control.stage is not Stage.TASK:
            words += f" – {control.stage.value}"
        elif control.held_s > 0.0:
            words += " – reached"
        counts = f"{control.reached} reached, {control.falls} fall{'s' * (control.falls != 1)}"
        return f"{words}\n\n{counts}"

    def origins(self) -> dict[str, str]:
        """See Source; of all policies of the room."""
        return lineage.origins([served.manifest.notes for served in self.room.policies.values()])

"""A walker that is watched as it comes up to boxes: where it arrives, a tracker is to go on."""

from collections.abc import Mapping

import torch
from torch import Tensor

from world.scene.batch import Scenes
from world.scene.target import Target
from world.teachers.walker import STANDING_M, WalkerTeacher, standing_place, taken
from world.tracking.arrivals import Arrivals, seen_from


class WatchedWalker:
    """Labels scenes of carry as its walker does, and keeps the states in which that has arrived; a
    world.teachers.teacher.Teacher."""

    def __init__(self, walker: WalkerTeacher, scenes: int) -> None:
        self._walker = walker
        self._over = torch.zeros(scenes, dtype=torch.bool)
        self._found: list[Arrivals] = []

    def reset(self, rows: Tensor, target: Target) -> None:
        """Watch for the next arrival in these scenes."""
        self._over[rows] = False

    def label(self, scenes: Scenes, target: Target, variant: Tensor, clock: int) -> Tensor:
        """The walker's actions [n, 28]; NaN where it has arrived."""
        box = target.box
        assert box is not None
        found = self._walker.label(scenes, target, variant, clock)
        over = found.isnan().any(dim=1)
        body = scenes.body()
        rows = torch.nonzero(over & ~taken(body, box) & ~self._over).flatten()
        self._over |= over
        if len(rows):
            qpos, qvel = scenes.qpos[rows].float(), scenes.qvel[rows].float()
            place, into = standing_place(body.root[:, :2], box)
            face = place + STANDING_M * into
            self._found.append(seen_from(qpos, qvel, face[rows], into[rows]))
        return found

    def arrivals(self) -> Arrivals:
        """Return what was seen so far, a state for each arrival."""
        qpos = [torch.zeros(0, 43), *(one.qpos for one in self._found)]
        qvel = [torch.zeros(0, 34), *(one.qvel for one in self._found)]
        return Arrivals(torch.cat(qpos), torch.cat(qvel))

    def state_dict(self) -> dict[str, Tensor]:
        """Nothing: it is not continued."""
        return {}

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Nothing."""

"""A walker that is watched: each arrival before a box that still stands is kept once."""

from types import SimpleNamespace
from typing import Any, cast

import torch
from torch import Tensor

from world import rotations
from world.character.model import BODIES
from world.scene.target import BoxState, Target
from world.teachers.arriving import WatchedWalker
from world.teachers.walker import WalkerTeacher


class Walker:
    """A stand-in: what it labels is given."""

    def __init__(self) -> None:
        self.found = torch.zeros(3, 28)

    def label(self, scenes: object, target: Target, variant: Tensor, clock: int) -> Tensor:
        return self.found


def target(x: float) -> Target:
    """Boxes of 0.2 × 0.3 m whose middle was 0.4 m along x from the scenes' origin and is at x."""
    level = torch.tensor([[1.0, 0.0, 0.0, 0.0]]).expand(3, -1)
    start = torch.tensor([[0.4, 0.0, 0.6]]).expand(3, -1)
    here = torch.tensor([[x, 0.0, 0.6]]).expand(3, -1)
    half = torch.tensor([[0.1, 0.15, 0.1]]).expand(3, -1)
    box = BoxState(here, level, torch.zeros(3, 3), half, start, start)
    return Target(start, torch.zeros(3, 2), torch.zeros(3, 8, 3), box=box)


def test_the_first_state_of_each_arrival_is_kept() -> None:
    qpos, qvel = torch.zeros(3, 43), torch.zeros(3, 34)
    qpos[:, 2], qpos[:, 3] = 0.85, 1.0
    qpos[:, 0] = torch.tensor((0.0, 0.05, 0.1))
    scenes = cast("Any", SimpleNamespace(qpos=qpos, qvel=qvel))
    scenes.body = lambda: SimpleNamespace(
        root=scenes.qpos[:, :3], position=torch.zeros(3, len(BODIES), 3)
    )
    walker = Walker()
    watch = WatchedWalker(cast("WalkerTeacher", walker), 3)

    def label(x: float, *arrived: int) -> Tensor:
        walker.found = torch.zeros(3, 28)
        walker.found[list(arrived)] = torch.nan
        return watch.label(scenes, target(x), torch.zeros(3), 0)

    assert len(watch.arrivals().qpos) == 0
    assert not bool(label(0.4).isnan().any())
    assert bool(label(0.4, 1)[1].isnan().all())
    label(0.4, 1)
    found = watch.arrivals()
    assert len(found.qpos) == 1
    # the near face is at 0.3 m, the character 0.05 m on its way there
    assert torch.allclose(found.qpos[0, :3], torch.tensor((-0.25, 0.0, 0.85)), atol=1e-6)
    assert float(rotations.yaw(rotations.heading(found.qpos[:, 3:7]))) == 0.0
    # who has taken the box is not arriving
    label(0.7, 0, 1)
    assert len(watch.arrivals().qpos) == 1
    # in a new episode there is a new arrival
    watch.reset(torch.tensor([1]), target(0.4))
    label(0.4, 1, 2)
    assert len(watch.arrivals().qpos) == 3
    assert watch.state_dict() == {}

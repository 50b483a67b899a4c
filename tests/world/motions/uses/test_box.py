"""Boxes of clips: where they are picked up and put down, how fast they move, when they are held."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import torch

from world.motions.clip import Clip
from world.motions.uses.box import BOX
from world.motions.uses.use import EXCLUDED, no_box
from world.scene.target import Target


def test_a_box_is_read_frame_by_frame(carried: Clip) -> None:
    used, track = BOX.read(carried), carried.box
    assert track is not None and used.has_object
    np.testing.assert_allclose(used.box.position, track.pose[:, :3], atol=1e-6)
    assert torch.equal(used.box.held, torch.from_numpy(track.held))
    first, last = np.flatnonzero(track.held)[[0, -1]]
    np.testing.assert_allclose(used.box.picked[0, :3], track.pose[first, :3], atol=1e-5)
    np.testing.assert_allclose(used.box.put[0, :3], track.pose[last + 1, :3], atol=1e-5)
    assert bool(used.box.has_picked.all()) and bool(used.box.has_put.all())
    # from rest to rest: the velocity adds up to the way
    way = used.box.velocity.sum(dim=0) / carried.fps
    np.testing.assert_allclose(way, track.pose[-1, :3] - track.pose[0, :3], atol=0.01)
    # who has put the box down has nothing more to do with it
    assert int(used.stage[-1]) == EXCLUDED


def test_a_clip_without_a_box_uses_nothing(carried: Clip) -> None:
    assert not BOX.read(replace(carried, box=None)).has_object
    target = Target(torch.zeros(1, 3), torch.zeros(1, 2), torch.zeros(1, 8, 3))
    assert BOX.with_object(carried, target, (0, 1)) is carried


def test_no_episode_starts_with_a_box_at_the_ground() -> None:
    heights = torch.tensor([0.30, 0.34, 0.36, 1.0])
    position = torch.stack((torch.zeros(4), torch.zeros(4), heights), dim=1)
    box = replace(no_box(4), position=position)
    table: Any = SimpleNamespace(box=box, qpos=torch.zeros(4, 43))
    assert BOX.unfit(table).tolist() == [True, True, False, False]

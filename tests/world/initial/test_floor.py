"""Initial states of walking: targets are near, far, or where the clip goes."""

import pytest
import torch
from torch import Tensor

from world.character import features
from world.character.features import Body
from world.config import InitialStates, WorldConfig
from world.initial.floor import FloorSampler
from world.motions import load
from world.motions.library import MotionLibrary
from world.motions.uses.floor import FLOOR
from world.objects.floor_bank import FloorBank
from world.scene.target import Target


@pytest.fixture(scope="module")
def library() -> MotionLibrary:
    clips = load.own_clips()
    wanted = ("walk_1.0", "stop_0.8", "turn_90")
    return MotionLibrary(
        [clip for clip in clips if clip.name in wanted or clip.seat is not None][:6], use=FLOOR
    )


def starts(library: MotionLibrary, mixture: InitialStates, n: int = 256) -> tuple[Body, Target]:
    config = WorldConfig(task="walk", initial=mixture)
    sampler = FloorSampler(config, library, FloorBank(), 0)
    drawn = sampler.draw(torch.arange(n), torch.ones(n, dtype=torch.int64))
    return features.body(drawn.qpos, drawn.qvel), sampler.target(drawn)


def distance(body: Body, where: Target) -> Tensor:
    return (where.point - body.root)[:, :2].norm(dim=1)


def test_starts_are_near_far_or_where_the_clip_goes(library: MotionLibrary) -> None:
    body, where = starts(library, InitialStates(0.0, 0.0, 1.0))
    assert 1.0 <= float(distance(body, where).min()) <= float(distance(body, where).max()) <= 10.0
    body, where = starts(library, InitialStates(0.0, 1.0, 0.0))
    near = distance(body, where)
    assert float(near.max()) <= 1.6 + 1e-5 and 0.3 < float((near < 0.75).float().mean()) < 0.7
    body, where = starts(library, InitialStates(1.0, 0.0, 0.0))
    # a walking character's target is ahead of it
    moving = body.root_velocity[:, :2].norm(dim=1) > 0.6
    ahead = ((where.point - body.root)[:, :2] * body.root_velocity[:, :2]).sum(dim=1)
    assert moving.sum() > 20 and float((ahead[moving] >= 0).float().mean()) > 0.9

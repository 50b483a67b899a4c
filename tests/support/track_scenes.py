"""A clip that carries a box, one that sits down, and the scenes to follow them in."""

from functools import cache

import numpy as np
import torch
from torch import Tensor

from world.character import features
from world.character.features import Body
from world.config import TrackConfig, WorldConfig
from world.motions.clip import Clip, mirrored
from world.motions.library import MotionLibrary
from world.motions.synthetic import library
from world.motions.synthetic.carries import carrying
from world.tasks.track import Track
from world.tracking.bank import TrackBank
from world.tracking.reference import Reference, reference
from world.tracking.sampler import TrackSampler
from world.tracking.target import TrackTarget

WORLD = WorldConfig(task="track", episode_s=10.0, track=TrackConfig(boxes=2))


@cache
def clips() -> tuple[Clip, ...]:
    """The carrying clip and its mirror image, then one that sits down and its mirror image."""
    carried = carrying(np.random.default_rng(3), (0.25, 0.36, 0.22), (0.5, 0.5), 1.5, 0.6)
    seated = library.sitting(np.random.default_rng(0), 0.44, 1.5, 0.3, 1, back=True)
    return carried, mirrored(carried), seated, mirrored(seated)


@cache
def followed() -> Reference:
    """Them as a reference."""
    return reference(clips())


@cache
def motions() -> MotionLibrary:
    """Them as a library: the mirror images are made there."""
    return MotionLibrary(clips()[::2], True, Track().affordance.clips)


@cache
def bank() -> TrackBank:
    """The scenes: two boxes for each clip that has one."""
    return TrackBank(clips(), followed(), WORLD.track)


def at(frames: Tensor, world: WorldConfig = WORLD) -> tuple[Body, TrackTarget]:
    """Characters and targets exactly as the reference has them at the frames [n]."""
    sampler = TrackSampler(world, bank(), 0)
    target = sampler.target(sampler.at(frames, torch.zeros(len(frames))))
    if target.box is not None:
        boxed = target.boxed()[:, None]
        exact = followed().box[frames, :3] + target.origin
        target.box.position.copy_(torch.where(boxed, exact, target.box.position))
    return body(frames, target), target


def body(frames: Tensor, target: TrackTarget) -> Body:
    """Characters in the poses of the frames [n], in the scenes of `target`."""
    qpos = followed().qpos[frames].clone()
    qpos[:, :3] += target.origin
    return features.body(qpos, followed().qvel[frames])


def held_frames() -> Tensor:
    """Frames of the carrying clip in which the box is carried."""
    mine = followed().held & (followed().clip == 0)
    return torch.nonzero(mine).flatten()

"""A clip that carries a box, one that sits down, and the scenes to follow them in."""

from functools import cache

import numpy as np
import torch
from torch import Tensor

from world.character import features
from world.character.features import Body
from world.config import TrackConfig, WorldConfig
from world.initial.track import TrackStarter
from world.motions.clip import Clip, mirrored
from world.motions.library import MotionLibrary
from world.motions.reference import Reference, reference
from world.motions.synthetic import library
from world.motions.synthetic.carries import carrying
from world.objects.track_bank import TrackBank
from world.tasks.track import Track, TrackPlace

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
    return MotionLibrary(clips()[::2], True, Track().affordance)


@cache
def bank() -> TrackBank:
    """The scenes: two boxes for each clip that has one."""
    return TrackBank(clips(), followed(), WORLD.track)


def at(frames: Tensor, world: WorldConfig = WORLD) -> tuple[Body, TrackPlace]:
    """Characters and places exactly as the reference has them at the frames [n]."""
    starter = TrackStarter(world, bank(), 0)
    place = starter.place(starter.at(frames, torch.zeros(len(frames))))
    if place.box is not None:
        boxed = place.boxed()[:, None]
        exact = followed().box[frames, :3] + place.origin
        place.box.position.copy_(torch.where(boxed, exact, place.box.position))
    return body(frames, place), place


def body(frames: Tensor, place: TrackPlace) -> Body:
    """Characters in the poses of the frames [n], in the scenes of `place`."""
    qpos = followed().qpos[frames].clone()
    qpos[:, :3] += place.origin
    return features.body(qpos, followed().qvel[frames])


def held_frames() -> Tensor:
    """Frames of the carrying clip in which the box is carried."""
    mine = followed().held & (followed().clip == 0)
    return torch.nonzero(mine).flatten()

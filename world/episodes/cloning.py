"""Pairs of observation and action that follow the clips, for behaviour cloning.

A servo settles where kp (set-point − q) = kd q̇ + load. Without load, a motion is therefore
followed by the set-point q[t+1] + (kd / kp) q̇[t+1]. The load of a box in the hands is added;
others are neglected.
"""

import torch
from torch import Tensor

from world import rotations, tasks
from world.character import features, servos
from world.character import model as character
from world.character.actions import ActionMap
from world.config import WorldConfig
from world.initial import squeeze
from world.motions.library import MotionLibrary
from world.objects.bank import ObjectBank

#: Noise on the states of the clips, so that the clone also covers states near them: rad (or m),
#: rad/s (or m/s).
_POSITION_NOISE, _VELOCITY_NOISE = 0.03, 0.3


def pairs(
    config: WorldConfig, library: MotionLibrary, bank: ObjectBank, samples: int, seed: int
) -> tuple[Tensor, Tensor]:
    """Observations (state and goal) [m, 114 + G] of noised clip states, and actions [m, 28] that
    follow the clips.

    m is at most `samples`: states in the rest pose have no next frame and are left out.
    """
    task = tasks.make(config.task)
    sampler = task.affordance.sampler(config, library, bank, seed)
    states = sampler.draw(torch.arange(samples), torch.zeros(samples, dtype=torch.int64))
    kept = torch.nonzero(states.frame >= 0).flatten()
    following = states.frame[kept] + 1
    generator = torch.Generator().manual_seed(seed)
    qpos, qvel = states.qpos[kept].clone(), states.qvel[kept].clone()
    qpos[:, 7:] += _POSITION_NOISE * torch.randn(qpos[:, 7:].shape, generator=generator)
    for address in character.BALL_QPOS:
        qpos[:, address : address + 4] = rotations.normalise(qpos[:, address : address + 4])
    qvel += _VELOCITY_NOISE * torch.randn(qvel.shape, generator=generator)

    target = sampler.target(states).rows(kept)
    body = features.body(qpos, qvel)
    observation = torch.cat((tasks.state(body, target), task.goal_features(body, target)), dim=1)

    base = target.set_points()
    if base is not None:  # action 0 follows the reference
        return observation, torch.zeros_like(base)

    kp, kd = (torch.from_numpy(g).to(torch.float32) for g in character.gains())
    velocity = library.qvel[following, 6:]
    set_point = servos.coordinates(library.qpos[following]) + kd / kp * velocity
    press, weight = sampler.load_n(states)
    set_point = set_point + squeeze.squeeze(library.qpos[following], press[kept], weight[kept])
    meaning = ActionMap.of(config.action_scale, config.action_clip, torch.float32)
    return observation, meaning.actions(meaning.bounded(set_point))

"""Actions that would follow the clips, to start a policy from: what the servos must be told at
each state.

A servo settles where kp (target − q) = kd q̇ + load, so that a motion is followed, load aside, by
the target q[t+1] + (kd / kp) q̇[t+1]. Of loads, that of a box in the hands is allowed for.
"""

import torch
from torch import Tensor

from world import rotations, tasks
from world.character import features, servos
from world.character import model as character
from world.config import WorldConfig
from world.initial import make as starters
from world.initial import squeeze
from world.motions.library import MotionLibrary
from world.objects.box_bank import BoxBank
from world.objects.furniture_bank import Bank
from world.objects.track_bank import TrackBank

#: Noise on the clip's states, so that the clone also answers states beside the clips: rad (or m),
#: rad/s.
_POSITION_NOISE, _VELOCITY_NOISE = 0.03, 0.3


def pairs(
    config: WorldConfig,
    library: MotionLibrary,
    bank: Bank | BoxBank | TrackBank,
    samples: int,
    seed: int,
) -> tuple[Tensor, Tensor]:
    """Observations (state and goal) [m, 114 + G] of noised clip states, and actions [m, 28] that
    follow.

    m is at most `samples`: starts from the rest pose have no next frame and are left out.
    """
    task = tasks.make(config.task)
    starter = starters.make(config, library, bank, seed)
    starts = starter.draw(torch.arange(samples), torch.zeros(samples, dtype=torch.int64))
    kept = torch.nonzero(starts.frame >= 0).flatten()
    following = starts.frame[kept] + 1
    generator = torch.Generator().manual_seed(seed)
    qpos, qvel = starts.qpos[kept].clone(), starts.qvel[kept].clone()
    qpos[:, 7:] += _POSITION_NOISE * torch.randn(qpos[:, 7:].shape, generator=generator)
    for address in character.BALL_QPOS:
        qpos[:, address : address + 4] = rotations.normalise(qpos[:, address : address + 4])
    qvel += _VELOCITY_NOISE * torch.randn(qvel.shape, generator=generator)

    place = starter.place(starts).rows(kept)
    body = features.body(qpos, qvel)
    observation = torch.cat((tasks.state(body, place), task.goal_features(body, place)), dim=1)

    kp, kd = (torch.from_numpy(g).to(torch.float32) for g in character.gains())
    velocity = library.qvel[following, 6:]
    target = servos.coordinates(library.qpos[following]) + kd / kp * velocity
    press, weight = starter.load_n(starts)
    target = target + squeeze.squeeze(library.qpos[following], press[kept], weight[kept])
    base = place.setpoints()
    if base is not None:  # what the reference says is done by actions of 0
        return observation, torch.zeros_like(base)
    low, high = (torch.from_numpy(b).to(torch.float32) for b in character.target_bounds())
    neutral = torch.from_numpy(character.neutral_targets()).to(torch.float32)
    action = (torch.maximum(torch.minimum(target, high), low) - neutral) / (
        config.action_scale * (high - low)
    )
    return observation, action

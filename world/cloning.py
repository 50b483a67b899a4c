"""Actions that would follow the clips, to start a policy from: what the servoes must be told at
each state.

A servo settles where kp (target − q) = kd q̇ + load, so that a motion is followed, load aside, by
the target q[t+1] + (kd / kp) q̇[t+1].
"""

import torch
from torch import Tensor

from world import character, features, rotations, tasks
from world.bank import Bank
from world.config import WorldConfig
from world.motions.library import MotionLibrary, servo_coordinates
from world.starts import Starter, furniture_pose
from world.tasks import Place

#: Noise on the clip's states, so that the clone also answers states beside the clips: rad (or m),
#: rad/s.
_POSITION_NOISE, _VELOCITY_NOISE = 0.03, 0.3


def pairs(
    config: WorldConfig, library: MotionLibrary, bank: Bank, samples: int, seed: int
) -> tuple[Tensor, Tensor]:
    """Observations (state and goal) [m, 114 + G] of noised clip states, and actions [m, 28] that
    follow.

    m is at most `samples`: starts from the rest pose have no next frame and are left out.
    """
    task = tasks.make(config.task)
    starter = Starter(config, library, bank, seed)
    starts = starter.draw(torch.arange(samples), torch.zeros(samples, dtype=torch.int64))
    kept = torch.nonzero(starts.frame >= 0).flatten()
    following = starts.frame[kept] + 1
    generator = torch.Generator().manual_seed(seed)
    qpos, qvel = starts.qpos[kept].clone(), starts.qvel[kept].clone()
    qpos[:, 7:] += _POSITION_NOISE * torch.randn(qpos[:, 7:].shape, generator=generator)
    for address in character.BALL_QPOS:
        qpos[:, address : address + 4] = rotations.normalise(qpos[:, address : address + 4])
    qvel += _VELOCITY_NOISE * torch.randn(qvel.shape, generator=generator)

    origin, yaw = furniture_pose(bank, starts)
    corners = rotations.turn(yaw[:, None], bank.corners[starts.variant]) + origin[:, None]
    point = torch.cat((starts.point, bank.point[starts.variant, 2:]), dim=1)
    place = Place(point, starts.facing, corners).rows(kept)
    body = features.body(qpos, qvel)
    state = features.state(body, place.floor_point(), place.facing)
    observation = torch.cat((state, task.goal_features(body, place)), dim=1)

    kp, kd = (torch.from_numpy(g).to(torch.float32) for g in character.gains())
    velocity = library.qvel[following, 6:]
    target = servo_coordinates(library.qpos[following]) + kd / kp * velocity
    low, high = (torch.from_numpy(b).to(torch.float32) for b in character.target_bounds())
    neutral = torch.from_numpy(character.neutral_targets()).to(torch.float32)
    action = (torch.maximum(torch.minimum(target, high), low) - neutral) / (
        config.action_scale * (high - low)
    )
    return observation, action

"""What the teachers share that lay a clip over a scene: comparing a state with the clip's frames,
and following the frame that is nearest to it."""

import torch
from torch import Tensor

from world import rotations
from world.character import features
from world.character.features import Body
from world.character.model import BODIES
from world.scene.batch import Scenes

#: Bodies by which a state is compared with a frame.
KEYS = [
    BODIES.index(name)
    for name in (
        "pelvis", "head", "torso", "right_hand", "left_hand", "right_foot", "left_foot",
    )
]  # fmt: skip
#: The reference is at most so many frames ahead of the one that is nearest to the state. Were it
#: not bound to the state, who stands still would see it pass, and learn the mean of what it shows.
AHEAD = 10
#: Nothing is labelled in states that are this far from every frame, m²: 0.4 m for each key body. A
#: tracker has never seen them, and what it does there would outweigh all that it knows.
LOST_M2 = 1.2


def turned(scenes: Scenes, rows: Tensor, back: Tensor) -> Body:
    """Return the characters of the scenes `rows` [m] in a clip's axes, turned by back [m, 2]
    (cosine, sine)."""
    qpos, qvel = scenes.qpos[rows].float(), scenes.qvel[rows].float()
    qpos[:, :2] = rotations.turn(back, qpos[:, :2])
    qpos[:, 3:7] = rotations.multiply(rotations.from_heading(back), qpos[:, 3:7])
    qvel[:, :2] = rotations.turn(back, qvel[:, :2])
    return features.body(qpos, qvel)


def level(back: Tensor, points: Tensor) -> Tensor:
    """Return points [m, ..., 3], or velocities, turned about the vertical by back [m, ..., 2]."""
    return torch.cat((rotations.turn(back, points[..., :2]), points[..., 2:]), dim=-1)


def followed(low: Tensor, high: Tensor, count: int) -> Tensor:
    """[m, count] int64: the frames from low [m] on, the last one, high [m], repeated."""
    return torch.minimum(low[:, None] + torch.arange(count), high[:, None])


def advanced(frame: Tensor, distance: Tensor, frames: Tensor) -> Tensor:
    """Return the next frames [m]: one on from `frame` [m], bound to the one of `frames` [m, F]
    that is nearest to the state by distance [m, F], and not beyond their last."""
    nearest = frames.gather(1, distance.argmin(dim=1, keepdim=True))[:, 0]
    bound = torch.maximum(torch.minimum(frame + 1, nearest + AHEAD), nearest)
    return torch.minimum(bound, frames[:, -1])

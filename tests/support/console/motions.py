"""Small motions of the character for the tests of files, and their bodies by MuJoCo."""

from functools import cache

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from world.character import model as character
from world.motions.clip import Clip
from world.motions.load import own_clips


@cache
def walk(frames: int = 40) -> Clip:
    """Part of the package's own walk: upright, with swinging limbs."""
    return next(clip for clip in own_clips() if clip.name == "walk_1.0").part(100, 100 + frames)


@cache
def sits(frames: int = 60) -> Clip:
    """From a stand to a seat: the knees bend by a right angle."""
    clip = next(clip for clip in own_clips() if clip.seat is not None)
    assert clip.seat is not None
    first = clip.seat.from_frame
    return clip.part(max(0, first - frames), first + 10)


def wild(frames: int = 5) -> Clip:
    """Random poses, none of which the character could take."""
    draw = np.random.default_rng(0)
    local = Rotation.random(frames * 15, random_state=1).as_quat(scalar_first=True)
    root = draw.normal(0.0, 3.0, (frames, 3))
    return Clip(
        "wild", 30, root.astype(np.float32), local.reshape(frames, 15, 4).astype(np.float32), "", ""
    )


def bodies(clip: Clip) -> tuple[np.ndarray, np.ndarray]:
    """Positions [T, 15, 3] m and rotations [T, 15, 3, 3] of the bodies: MuJoCo's own kinematics of
    the joints, which the poses of `walk` and `sits` can be."""
    model = character.spec().compile()
    data = mujoco.MjData(model)
    found, turned = [], []
    for qpos in clip.qpos():
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        found.append(data.xpos[1:].copy())
        turned.append(data.xmat[1:].reshape(-1, 3, 3).copy())
    return np.stack(found), np.stack(turned)


def y_up(positions: np.ndarray) -> np.ndarray:
    """Positions [..., 3] with y up and z ahead: ours are x forward, y left, z up."""
    x, y, z = np.moveaxis(positions, -1, 0)
    return np.stack((y, z, x), axis=-1)

"""Takes in which all moves: a sitter with a pushed chair and balls, a carrier, a follower."""

from dataclasses import replace

import numpy as np

from console.recording.format import Take, rows_of
from tests.support.console.motions import sits, walk
from tests.support.console.recordings import take
from world.motions.clip import Clip
from world.scene.box import STAND


def _with(clip: Clip) -> Take:
    still, qpos = take(clip.frames), clip.qpos().astype(np.float64)
    return replace(still, qpos=qpos, qvel=np.zeros((clip.frames, 34)))


def pushed(frames: int = 30) -> Take:
    """Beside a chair that is turned and displaced; two balls, of which one comes late and goes."""
    found = _with(sits().part(0, frames))
    turn = np.linspace(0.0, 0.5, frames)
    quaternion = np.stack((np.cos(turn / 2), 0 * turn, 0 * turn, np.sin(turn / 2)), axis=1)
    balls = np.full((frames, 2, 3), np.nan)
    balls[:, 0] = np.linspace((0, 0, 1), (1, 2, 1.5), frames)
    balls[5:20, 1] = np.linspace((3, 0, 1), (0, 0, 0.5), 15)
    return replace(
        found,
        mocap_pos=np.linspace((1.0, 0.5, 0.0), (1.6, 0.2, 0.0), frames),
        mocap_quat=quaternion,
        balls=balls,
        meta={"ball_radius_m": 0.09},
    )


def carried(frames: int = 30) -> Take:
    """With a box that rises, between two stands."""
    found = _with(walk().part(0, frames))
    box = np.zeros((frames, 7))
    box[:, :3] = np.linspace((0.5, 0.2, 0.75), (1.0, 0.4, 1.1), frames)
    box[:, 3] = 1.0
    return replace(
        found,
        qpos=np.concatenate((found.qpos, box), axis=1),
        qvel=np.zeros((frames, 40)),
        mocap_pos=np.tile([0.5, 0.2, 0.6], (frames, 1)),
        boxes=rows_of(STAND.boxes),
        piece="box",
        cargo=np.array([0.175, 0.25, 0.15]),
        stand=np.array([2.0, 1.0, 0.7]),
    )


def followed(frames: int = 20) -> Take:
    """Behind a reference, without furniture."""
    found = _with(walk().part(0, frames))
    ghost = found.qpos.copy()
    ghost[:, 0] += 0.5
    return replace(found, boxes=np.zeros((0, 10)), piece="", ghost=ghost)

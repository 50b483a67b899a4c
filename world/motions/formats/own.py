"""Recordings on the character's own skeleton: our clips, and formats with our bones and axes.

A clip is read as a recording so that it can be imported again, which corrects its contacts.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from world.character import kinematics, soles
from world.character import model as character
from world.motions import clip_file
from world.motions.formats.recording import Recording, forward
from world.motions.licences import licence

SUFFIXES, KEYS = (clip_file.SUFFIX,), clip_file.KEYS
_SOLE_FRONT_M = np.array(soles.FRONT_M)
NAMES = (*character.BODIES, "right_foot_end", "left_foot_end")
PARENTS = (
    *character.PARENTS,
    character.BODIES.index("right_foot"),
    character.BODIES.index("left_foot"),
)


def read(path: Path) -> Recording:
    """Return the clip in a file of our own format as a recording."""
    clip = clip_file.read(path)
    root, local = clip.root_position_m.astype(float), clip.local_rotation.astype(float)
    return recording(path, clip.fps, root, local)


def offsets() -> np.ndarray:
    """Body offsets in the parent's frame, m: [15, 3]."""
    return kinematics.offsets().numpy().astype(np.float64)


def recording(path: Path, fps: float, root: np.ndarray, local: np.ndarray) -> Recording:
    """A recording of root positions [T, 3] m and local quaternions [T, 15, 4] (w, x, y, z)."""
    turn = Rotation.from_quat(local.reshape(-1, 4), scalar_first=True).as_matrix()
    turn = turn.reshape(-1, 15, 3, 3)
    # the fronts of the soles are joints too, so that standing on the toes is detected
    turn = np.concatenate((turn, np.tile(np.eye(3), (len(turn), 2, 1, 1))), axis=1)
    offset = np.concatenate((offsets(), np.tile(_SOLE_FRONT_M, (2, 1))))
    position, rotation = forward(PARENTS, offset, turn, root)
    return Recording(
        name=path.stem,
        fps=fps,
        names=NAMES,
        parents=PARENTS,
        position=position,
        rotation=rotation,
        source=path.name,
        licence=licence(path),
        unit_m=1.0,
        up="z",
        own_body=True,
        bones_known=True,
    )


def hinge(flexion: np.ndarray, body: str) -> np.ndarray:
    """Local quaternions [T, 4] of an elbow's or a knee's flexion [T] rad."""
    sign = -1.0 if "lower_arm" in body else 1.0
    half = 0.5 * sign * flexion
    zero = np.zeros_like(half)
    return np.stack([np.cos(half), zero, np.sin(half), zero], axis=-1)

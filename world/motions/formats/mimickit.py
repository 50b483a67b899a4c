"""Reader of MimicKit's `.pkl` motions of its humanoid: root, its rotation vector, 28 joint angles.

Source: github.com/xbpeng/MimicKit, mimickit/anim/motion.py and data/assets/humanoid/humanoid.xml:
our bones and joint order, z up, ball joints as rotation vectors. Its rest pose has spread arms,
ours and that of older files have hanging ones. The sign of the left elbow shows which: with spread
arms it bends by negative angles.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from world.character import model as character
from world.errors import ClipError
from world.motions.formats import own, safe_pickle
from world.motions.formats.recording import Recording
from world.refusals import reason

SUFFIXES = (".pkl",)
KEYS = ("frames", "fps")
_COLUMNS = 34


def read(path: Path) -> Recording:
    """The motion in a MimicKit pickle. Raises ClipError."""
    content = safe_pickle.load(path)
    missing = [key for key in KEYS if key not in safe_pickle.keys(content, path)]
    if missing:
        raise ClipError(f"{path}: no {', '.join(missing)}; a MimicKit motion has {', '.join(KEYS)}")
    try:
        frames = safe_pickle.numbers(content["frames"])
        fps = safe_pickle.number(content["fps"])
    except (ValueError, TypeError) as error:
        raise ClipError(f"{path}: not a readable MimicKit motion ({reason(error)})") from error
    if frames.ndim != 2 or frames.shape[1] != _COLUMNS:
        raise ClipError(
            f"{path}: frames are {list(frames.shape)}; MimicKit's humanoid has {_COLUMNS} numbers"
            " a frame (root 3, its rotation vector 3, joints 28)"
        )
    if not np.isfinite(frames).all():
        raise ClipError(f"{path}: holds non-finite values")
    local = np.tile([1.0, 0, 0, 0], (len(frames), 15, 1))
    local[:, 0] = Rotation.from_rotvec(frames[:, 3:6]).as_quat(scalar_first=True)
    spread = arms_spread(frames)
    column = 6
    for body, joint in zip(character.JOINT_BODIES, character.JOINTS, strict=True):
        name = character.BODIES[body]
        if joint.is_ball:
            turn = Rotation.from_rotvec(frames[:, column : column + 3])
            if spread and name.endswith("upper_arm"):
                turn = turn * _hanging(name)
            local[:, body] = turn.as_quat(scalar_first=True)
            column += 3
        else:
            sign = -1.0 if spread and name == "left_lower_arm" else 1.0
            local[:, body] = own.hinge(sign * frames[:, column], name)
            column += 1
    return own.recording(path, fps, frames[:, :3], local)


def arms_spread(frames: np.ndarray) -> bool:
    """Whether frames [T, 34] are relative to a rest pose with spread arms."""
    left_elbow = 6 + sum(len(j.range_deg) for j in character.JOINTS[:5])
    return bool(frames[:, left_elbow].mean() < 0)


def _hanging(name: str) -> Rotation:
    """Rotation from our hanging upper arm to MimicKit's spread one, in the chest's axes."""
    return Rotation.from_euler("x", -90.0 if name.startswith("right") else 90.0, degrees=True)

"""Reader of DeepMimic's `.txt` motions; their humanoid is ours with y up and z to the right.

Source: github.com/xbpeng/DeepMimic, data/motions and its wiki: 44 numbers per frame; rotations w,
x, y, z in the parent's frame; knees bend by negative, elbows by positive angles.
"""

import json
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from world.character import model as character
from world.errors import ClipError
from world.motions.formats import own
from world.motions.formats.recording import Recording
from world.refusals import reason

SUFFIXES = (".txt", ".json")
_COLUMNS = 44
#: Greatest number of frames of a resampled motion: hours.
_MOST_STEPS = 1_000_000
_BALLS = {
    "pelvis": 4,
    "torso": 8,
    "head": 12,
    "right_thigh": 16,
    "right_foot": 21,
    "right_upper_arm": 25,
    "left_thigh": 30,
    "left_foot": 35,
    "left_upper_arm": 39,
}
_HINGES = {"right_shin": 20, "right_lower_arm": 29, "left_shin": 34, "left_lower_arm": 43}


def read(path: Path) -> Recording:
    """The motion in a DeepMimic file. Raises ClipError."""
    try:
        content = json.loads(path.read_bytes())
        rows = content["Frames"]
        frames = np.array(rows, dtype=np.float64)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ClipError(f"{path}: not a readable DeepMimic motion ({reason(error)})") from error
    if frames.ndim != 2 or frames.shape[1] != _COLUMNS:
        shape = list(frames.shape)
        raise ClipError(f"{path}: frames are {shape}; DeepMimic's have {_COLUMNS} numbers each")
    if len(frames) < 2:
        raise ClipError(f"{path}: {len(frames)} frame(s); a transition needs at least 2")
    if not np.isfinite(frames).all():
        raise ClipError(f"{path}: holds non-finite values")
    root = np.stack((frames[:, 1], -frames[:, 3], frames[:, 2]), axis=-1)
    local = np.tile([1.0, 0, 0, 0], (len(frames), 15, 1))
    for body, column in _BALLS.items():
        q = frames[:, column : column + 4]
        length = np.linalg.norm(q, axis=-1, keepdims=True)
        if (np.abs(length - 1) > 0.05).any():
            raise ClipError(f"{path}: columns {column}-{column + 3} are no unit quaternions")
        q = q / length
        local[:, character.BODIES.index(body)] = np.stack(
            (q[:, 0], q[:, 1], -q[:, 3], q[:, 2]), axis=-1
        )
    for body, column in _HINGES.items():
        flexion = frames[:, column] * (-1.0 if "shin" in body else 1.0)
        local[:, character.BODIES.index(body)] = own.hinge(flexion, body)
    duration = frames[:-1, 0]
    if not (duration > 0).all():
        raise ClipError(f"{path}: a frame lasts {duration.min():g} s; durations are above 0")
    return own.recording(path, *_uniform(path, duration, root, local))


def _uniform(
    path: Path, duration: np.ndarray, root: np.ndarray, local: np.ndarray
) -> tuple[float, np.ndarray, np.ndarray]:
    """Rate, root positions and rotations at equal time steps."""
    step = float(np.median(duration))
    if np.ptp(duration) < 0.01 * step:
        return 1.0 / step, root, local
    times = np.concatenate(([0.0], np.cumsum(duration)))
    if not times[-1] < _MOST_STEPS * step:
        raise ClipError(
            f"{path}: lasts {times[-1]:.3g} s at {step:.3g} s a frame; at most {_MOST_STEPS} frames"
        )
    at = np.arange(0.0, times[-1] + 1e-9, step)
    moved = np.stack([np.interp(at, times, column) for column in root.T], axis=-1)
    turned = np.stack(
        [
            Slerp(times, Rotation.from_quat(local[:, b], scalar_first=True))(at).as_quat(
                scalar_first=True
            )
            for b in range(local.shape[1])
        ],
        axis=1,
    )
    return 1.0 / step, moved, turned

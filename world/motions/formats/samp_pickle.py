"""Reader of SAMP's `.pkl` motions (SMPL-X poses fitted by MoSh++).

Source: samp.is.tue.mpg.de, and its published code (Hassan et al. 2021): `pose_est_fullposes` [T,
165], `pose_est_trans` [T, 3], `mocap_framerate`. The pickle is read without executing code.
"""

from pathlib import Path

from world.errors import ClipError
from world.motions.formats import safe_pickle, smpl
from world.motions.formats.recording import Recording
from world.refusals import reason

SUFFIXES = (".pkl",)
KEYS = ("pose_est_fullposes", "pose_est_trans", "mocap_framerate")


def read(path: Path) -> Recording:
    """The motion in a SAMP pickle. Raises ClipError."""
    content = safe_pickle.load(path)
    missing = [key for key in KEYS if key not in safe_pickle.keys(content, path)]
    if missing:
        raise ClipError(f"{path}: no {', '.join(missing)}; a SAMP motion has {', '.join(KEYS)}")
    try:
        poses = safe_pickle.numbers(content["pose_est_fullposes"])
        translation = safe_pickle.numbers(content["pose_est_trans"])
        fps = safe_pickle.number(content["mocap_framerate"])
    except (ValueError, TypeError) as error:
        raise ClipError(f"{path}: not a readable SAMP motion ({reason(error)})") from error
    return smpl.recording(path, fps, translation, poses)

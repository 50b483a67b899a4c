"""Reader of AMASS `.npz` motions (SMPL+H and SMPL-X poses).

Source: github.com/nghorbani/amass: `trans`, `poses` or `root_orient` and `pose_body`, `betas`,
`gender`, and the rate as `mocap_framerate` or `mocap_frame_rate`, of any shape.
"""

import zipfile
from pathlib import Path

import numpy as np

from world.errors import ClipError
from world.motions import npz
from world.motions.formats import smpl
from world.motions.formats.recording import RateMissingError, Recording
from world.refusals import reason

SUFFIXES = (".npz",)
RATES = ("mocap_framerate", "mocap_frame_rate", "framerate", "frame_rate", "fps")


def read(path: Path) -> Recording:
    """The motion in an AMASS file. Raises ClipError."""
    try:
        with npz.opened(path) as file:
            rate = next((key for key in RATES if key in file), None)
            fps = 1.0 if rate is None else npz.scalar(file[rate])
            translation = file["trans"]
            if "poses" in file:
                poses = file["poses"]
            else:
                poses = np.concatenate((file["root_orient"], file["pose_body"]), axis=1)
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise ClipError(f"{path}: not a readable AMASS motion ({reason(error)})") from error
    recording = smpl.recording(path, fps, translation, poses)
    if rate is None:
        raise RateMissingError(f"{path}: no rate: AMASS has {' or '.join(RATES[:2])}", recording)
    return recording

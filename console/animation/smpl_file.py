"""SMPL parameters in the fields of AMASS (`.smpl.npz`): poses and translation, no body model.

World: metres, z up, the character's +x ahead. A pose of zeros is SMPL's T-pose, with x to the left,
y up and z ahead: the root's rotation brings it into the world. Joints and bones are those of the
mean SMPL body (`world.motions.formats.smpl`), whose legs are 2.8 % shorter than the character's:
the travel is scaled by that.

Field names: github.com/nghorbani/amass. Poses are SMPL+H's 52 joints; the 30 of the fingers are 0.
"""

import io

import numpy as np
from scipy.spatial.transform import Rotation

from console.animation.retarget import onto
from console.animation.rig import Rig
from world.motions import clip_file
from world.motions.clip import Clip
from world.motions.formats import smpl

SUFFIX = clip_file.SMPL_SUFFIX
#: Joints of SMPL+H, of which the first 22 are the body's.
JOINTS = 52
_BETAS, _DMPLS = 16, 8


def mean_body() -> Rig:
    """Return the skeleton of the mean SMPL body in its T-pose: x left, y up, z ahead, m."""
    offsets = smpl.offsets()
    position = np.zeros_like(offsets)
    position[0] = smpl.ROOT_M
    for joint, parent in enumerate(smpl.PARENTS):
        if parent >= 0:
            position[joint] = position[parent] + offsets[joint]
    turns = np.tile(np.eye(3), (len(offsets), 1, 1))
    return Rig("SMPL", smpl.NAMES, smpl.PARENTS, position, turns)


def parameters(clip: Clip) -> dict[str, np.ndarray]:
    """Return the arrays of a clip's file by AMASS's names.

    poses [T, 156] rotation vectors, rad; trans [T, 3] m; betas [16] and dmpls [T, 8], all 0;
    gender; mocap_framerate, Hz; and source and licence.
    """
    body = mean_body()
    fitted = onto(clip, body, body.parts(None), np.eye(3))
    poses = np.zeros((clip.frames, JOINTS, 3))
    for joint in range(len(body.names)):
        vectors = Rotation.from_matrix(fitted.skeleton.local[:, joint]).as_rotvec()
        poses[:, joint] = _continuous(vectors)
    return {
        "poses": poses.reshape(clip.frames, -1),
        "trans": fitted.hips_position - smpl.ROOT_M,
        "betas": np.zeros(_BETAS),
        "dmpls": np.zeros((clip.frames, _DMPLS)),
        "gender": np.array("neutral"),
        "mocap_framerate": np.array(float(clip.fps)),
        "source": np.array(clip.source),
        "licence": np.array(clip.licence),
    }


def content(clip: Clip) -> bytes:
    """Return the bytes of a clip's file."""
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **parameters(clip))
    return buffer.getvalue()


def _continuous(vectors: np.ndarray) -> np.ndarray:
    """Return equivalent rotation vectors [T, 3] without jumps of a full turn."""
    found = vectors.copy()
    for frame in range(1, len(found)):
        angle, before = np.linalg.norm(found[frame]), np.linalg.norm(found[frame - 1])
        if max(angle, before) < 1e-9:
            continue
        # no turn at all has any axis: that of the frame before
        axis = found[frame] / angle if angle >= 1e-9 else found[frame - 1] / before
        turns = np.round((found[frame - 1] @ axis - angle) / (2 * np.pi))
        found[frame] = axis * (angle + 2 * np.pi * turns)
    return found

"""Recordings of SMPL-family poses: 22 body joints, rotation vectors, a translation.

The body models have a licence of their own and are not read: joints have the offsets of the mean
SMPL body of 1.7 m for every subject. Offsets: Loper et al. 2015, "SMPL: a
skinned multi-person linear model", mean shape, its joint regressor; rounded to the millimetre, the
mean of both sides.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from world.errors import ClipError
from world.motions.formats.recording import Recording, forward
from world.motions.licences import licence

NAMES = (
    "Pelvis", "L_Hip", "R_Hip", "Spine1", "L_Knee", "R_Knee", "Spine2", "L_Ankle", "R_Ankle",
    "Spine3", "L_Foot", "R_Foot", "Neck", "L_Collar", "R_Collar", "Head", "L_Shoulder",
    "R_Shoulder", "L_Elbow", "R_Elbow", "L_Wrist", "R_Wrist",
)  # fmt: skip
PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19)
#: Offsets of the left and middle joints, mm: x to the left, y up, z ahead, arms spread.
_OFFSET_MM = {
    "Hip": (59, -86, -16),
    "Knee": (43, -385, 2),
    "Ankle": (-17, -423, -36),
    "Foot": (38, -61, 126),
    "Collar": (77, 113, -21),
    "Shoulder": (118, 46, -14),
    "Elbow": (258, -15, -27),
    "Wrist": (267, 10, -7),
    "Spine1": (0, 124, -38),
    "Spine2": (0, 138, 27),
    "Spine3": (0, 56, 3),
    "Neck": (0, 212, -33),
    "Head": (0, 89, 50),
}
#: Position of the root joint before the translation, m.
ROOT_M = np.array([-0.002, -0.241, 0.029])
#: Greatest difference of the rows of poses and translations.
_ROWS_FEW = 3
APPROXIMATED = (
    "joints of the mean SMPL body (1.7 m): the person's own shape (betas, gender) is left out",
)


def offsets() -> np.ndarray:
    """Joint offsets in the parent's frame, m: [22, 3]."""
    rows = []
    for name in NAMES:
        side, _, part = name.rpartition("_")
        x, y, z = _OFFSET_MM.get(part, (0, 0, 0))
        rows.append((-x if side == "R" else x, y, z))
    return np.array(rows) * 1e-3


def recording(path: Path, fps: float, translation: np.ndarray, poses: np.ndarray) -> Recording:
    """A recording of translations [T, 3] m and rotation vectors [T, 66 or more] rad, body first.

    Where one of them has a few rows more, the rows that both have are read, which is remarked.
    """
    remarks = APPROXIMATED
    if poses.ndim == 3 and poses.shape[2] == 3:
        poses = poses.reshape(len(poses), -1)
    if poses.ndim == translation.ndim == 2 and 0 < abs(len(poses) - len(translation)) <= _ROWS_FEW:
        both = min(len(poses), len(translation))
        remarks += (f"{both} frames of {len(poses)} poses and {len(translation)} translations",)
        poses, translation = poses[:both], translation[:both]
    if poses.ndim != 2 or poses.shape[1] < 66 or translation.shape != (len(poses), 3):
        raise ClipError(
            f"{path}: poses are {list(poses.shape)} and translations {list(translation.shape)};"
            " expected [T, 66 or more] and [T, 3]"
        )
    vectors = poses[:, :66].astype(np.float64).reshape(-1, 3)
    if not (np.isfinite(vectors).all() and np.isfinite(translation).all()):
        raise ClipError(f"{path}: holds non-finite values")
    local = Rotation.from_rotvec(vectors).as_matrix().reshape(len(poses), 22, 3, 3)
    root = translation.astype(np.float64) + ROOT_M
    position, rotation = forward(PARENTS, offsets(), local, root)
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
        bones_known=True,
        likely_up="z",
        approximated=remarks,
    )

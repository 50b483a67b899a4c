"""Reader of BVH files (Biovision hierarchy), such as CMU's, ACCAD's and LAFAN1's.

The unit and the upward axis, which BVH does not state, are inferred later. The ROOT's OFFSET is not
added to its position channels: some files repeat the first frame there. Position channels of any
other joint move it: they replace its OFFSET, or are added to it, whichever keeps the bone.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from world.errors import ClipError
from world.motions.formats import bvh_text
from world.motions.formats.recording import RateMissingError, Recording, forward
from world.motions.licences import licence
from world.motions.text import decoded
from world.refusals import reason

SUFFIXES = (".bvh",)
#: A first frame is a pose added by the converter where all joints leave it at more than this
#: multiple of their usual speed, and by this many radians on average.
_ADDED_POSE = 8.0
_ADDED_POSE_RAD = 0.15
#: Channels at this fraction of the OFFSET's length from it, or from 0, are there.
_THERE = 1e-3


def read(path: Path) -> Recording:
    """The motion in a BVH file. Raises ClipError."""
    try:
        content = bvh_text.parsed(decoded(path.read_bytes()))
    except (OSError, ValueError) as error:
        raise ClipError(f"{path}: not a readable BVH file ({reason(error)})") from error
    rows, joints = content.rows, content.joints
    local = np.tile(np.eye(3), (len(rows), len(joints), 1, 1))
    offset = np.empty((len(rows), len(joints), 3))
    for index, joint in enumerate(joints):
        values = rows[:, joint.first : joint.first + len(joint.channels)]
        offset[:, index] = _offsets(joint, values)
        for channel, angle in zip(joint.channels, values.T, strict=True):
            if channel[0] == "r":
                turn = Rotation.from_euler(channel[1], angle[:, None], degrees=True).as_matrix()
                local[:, index] = local[:, index] @ turn
    parents = tuple(joint.parent for joint in joints)
    position, rotation = forward(parents, offset, local, offset[:, 0])
    first = 1 if has_added_pose(local) else 0
    recording = Recording(
        name=path.stem,
        fps=1.0 / content.frame_s if content.frame_s else 1.0,
        names=tuple(joint.name for joint in joints),
        parents=parents,
        position=position,
        rotation=rotation,
        source=path.name,
        licence=licence(path),
        approximated=(
            *(("first frame left out: a pose put in front",) if first else ()),
            *content.remarks,
        ),
    ).part(first, len(rows))
    if not content.frame_s:
        raise RateMissingError(f"{path}: its Frame Time is missing or 0", recording)
    return recording


def _offsets(joint: bvh_text.Joint, values: np.ndarray) -> np.ndarray:
    """The joint's origin in its parent's axes, [T, 3], from its channels [T, c]."""
    offset = np.array(joint.offset)
    moved = np.tile(offset, (len(values), 1))
    columns = [index for index, channel in enumerate(joint.channels) if channel[0] == "p"]
    if not columns or not len(values):
        return moved
    axes = ["xyz".index(joint.channels[index][1]) for index in columns]
    given = values[:, columns]
    adds = joint.parent >= 0 and _adds(given, offset[axes])
    moved[:, axes] = given + (offset[axes] if adds else 0.0)
    return moved


def _adds(given: np.ndarray, offset: np.ndarray) -> bool:
    """Whether position channels [T, k] are relative to the OFFSET [k] rather than in its place.

    They are where they pass through 0 and not through the OFFSET, or are mostly nearer to 0.
    """
    length = float(np.linalg.norm(offset))
    if not length > 0:
        return False
    from_offset = np.linalg.norm(given - offset, axis=1)
    from_zero = np.linalg.norm(given, axis=1)
    if from_offset.min() < _THERE * length:
        return False
    if from_zero.min() < _THERE * length:
        return True
    return bool(np.median(from_zero - from_offset) < 0)


def has_added_pose(local: np.ndarray) -> bool:
    """Whether the first of local rotations [T, J, 3, 3] is a pose that the converter added."""
    if local.shape[0] < 4:
        return False
    turned = np.swapaxes(local[:-1], -1, -2) @ local[1:]
    trace = np.trace(turned, axis1=-2, axis2=-1)
    angle = np.arccos(np.clip((trace - 1) / 2, -1, 1)).mean(axis=1)
    return bool(angle[0] > max(_ADDED_POSE * np.median(angle[1:]), _ADDED_POSE_RAD))

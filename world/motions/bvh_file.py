"""Clips as BVH files (Biovision hierarchy) for animation programs: centimetres, y up, z forward.

A joint for every body of the character, with the hands; three angles per joint, about z, then the
new x, then the new y, in degrees and without jumps from frame to frame.
"""

import warnings

import numpy as np
from scipy.spatial.transform import Rotation

from world.character import kinematics
from world.character import model as character
from world.motions.clip import Clip

ORDER = "ZXY"
#: End sites of bodies without children, in the body's frame, m: the crown, the hand's sphere, the
#: front of the sole.
ENDS_M = {
    "head": (0.0, 0.0, 0.27),
    "right_hand": (0.0, 0.0, -0.04),
    "left_hand": (0.0, 0.0, -0.04),
    "right_foot": (0.1335, 0.0, -0.05),
    "left_foot": (0.1335, 0.0, -0.05),
}
#: Our x (forward), y (left), z (up) are BVH's z, x, y.
_AXES = (1, 2, 0)
_CM = 100.0


def text(clip: Clip) -> str:
    """The text of a clip's BVH file."""
    lines = ["HIERARCHY", *_joint(0, "")]
    lines += ["MOTION", f"Frames: {clip.frames}", f"Frame Time: {1.0 / clip.fps:.7f}"]
    rows = channels(clip)
    lines += [" ".join(f"{value:.6f}" for value in row) for row in rows]
    return "\n".join(lines) + "\n"


def channels(clip: Clip) -> np.ndarray:
    """[T, 3 + 45]: the root's position (cm), then three angles (degrees) per body, in the order of
    the character's bodies."""
    position = _CM * clip.root_position_m[:, _AXES].astype(np.float64)
    # in other axes a rotation has a permuted axis and the same angle
    local = clip.local_rotation[..., (0, *(1 + axis for axis in _AXES))].astype(np.float64)
    with warnings.catch_warnings():
        # where two axes coincide, any split between their angles is right
        warnings.simplefilter("ignore", UserWarning)
        turned = Rotation.from_quat(local.reshape(-1, 4), scalar_first=True)
        angles = turned.as_euler(ORDER, degrees=True).reshape(clip.frames, -1, 3)
    return np.concatenate((position, continuous(angles).reshape(clip.frames, -1)), axis=1)


def continuous(angles: np.ndarray) -> np.ndarray:
    """Equivalent angles [T, n, 3] (degrees, ORDER) that are continuous in time.

    (a, b, c) and (a + 180, 180 − b, c + 180) are one rotation, as are angles plus full turns: each
    frame takes the nearest of these to the frame before.
    """
    found = angles.copy()
    for frame in range(1, len(found)):
        before, here = found[frame - 1], found[frame]
        other = np.stack((here[:, 0] + 180.0, 180.0 - here[:, 1], here[:, 2] + 180.0), axis=1)
        near, far = (a - 360.0 * np.round((a - before) / 360.0) for a in (here, other))
        swap = np.abs(far - before).sum(axis=1) < np.abs(near - before).sum(axis=1)
        found[frame] = np.where(swap[:, None], far, near)
    return found


def _joint(body: int, indent: str) -> list[str]:
    """The lines of a body and its descendants."""
    name, deeper = character.BODIES[body], indent + "\t"
    kind = "JOINT" if body else "ROOT"
    angles = "Zrotation Xrotation Yrotation"
    lines = [f"{indent}{kind} {name}", f"{indent}{{"]
    lines.append(deeper + _offset(kinematics.offsets()[body].tolist()))
    if body:
        lines.append(f"{deeper}CHANNELS 3 {angles}")
    else:
        lines.append(f"{deeper}CHANNELS 6 Xposition Yposition Zposition {angles}")
    for child, parent in enumerate(character.PARENTS):
        if parent == body:
            lines += _joint(child, deeper)
    if name in ENDS_M:
        end = _offset(ENDS_M[name])
        lines += [f"{deeper}End Site", f"{deeper}{{", f"{deeper}\t{end}", f"{deeper}}}"]
    return [*lines, f"{indent}}}"]


def _offset(offset_m: tuple[float, ...] | list[float]) -> str:
    x, y, z = (_CM * offset_m[axis] for axis in _AXES)
    return f"OFFSET {x:.6f} {y:.6f} {z:.6f}"

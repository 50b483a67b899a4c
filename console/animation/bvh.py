"""BVH files (Biovision hierarchy) for animation programs.

Three angles for each joint, about z, then the new x, then the new y, or in a rig's own order, in
degrees and without jumps from frame to frame.
"""

import warnings

import numpy as np
from scipy.spatial.transform import Rotation

from console.animation.skeleton import Y_UP, Array, Rest, Skeleton, of_clip
from world.motions.clip import Clip

ORDER = "zxy"
_CM = 100.0
#: Length of the end of a joint that has neither children nor an end, of the skeleton's height.
_STUB = 0.02


def text(clip: Clip, rest: Rest = "hanging", root_motion: bool = False) -> str:
    """Return the text of a clip's BVH file: centimetres, y up, z forward, a joint for every body of
    the character, and with `root_motion` one on the floor above them."""
    return written(of_clip(clip, rest, root_motion).turned(Y_UP).scaled(_CM))


def written(skeleton: Skeleton) -> str:
    """Return the text of a skeleton, in its own axes and unit.

    Displaced joints other than the root must have an offset of 0: programs differ in whether
    position channels add to it.
    """
    children = _children(skeleton)
    order = _depth_first(children)
    lines = ["HIERARCHY", *_joint(skeleton, children, 0, "")]
    lines += ["MOTION", f"Frames: {skeleton.frames}", f"Frame Time: {1.0 / skeleton.fps:.7f}"]
    lines += [" ".join(f"{x:.6f}" for x in row) for row in channels(skeleton, order)]
    return "\n".join(lines) + "\n"


def channels(skeleton: Skeleton, joints: list[int]) -> Array:
    """Return the rows [T, C] of the given joints: positions of those that are displaced, then
    three angles, degrees."""
    columns: list[Array] = []
    for joint in joints:
        if joint in skeleton.moves:
            columns.append(skeleton.moves[joint])
        order = skeleton.orders.get(joint, ORDER).upper()
        turns = Rotation.from_matrix(skeleton.local[:, joint])
        with warnings.catch_warnings():
            # where two axes coincide, any split between their angles is right
            warnings.simplefilter("ignore", UserWarning)
            angles = turns.as_euler(order, degrees=True)
        columns.append(continuous(angles[:, None])[:, 0])
    return np.concatenate(columns, axis=1)


def continuous(angles: Array) -> Array:
    """Return equivalent angles [T, n, 3] (degrees, about three different axes) that are continuous
    in time.

    (a, b, c) and (a + 180, 180 - b, c + 180) are one rotation, as are angles plus full turns: each
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


def _children(skeleton: Skeleton) -> list[list[int]]:
    found: list[list[int]] = [[] for _ in skeleton.parents]
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0:
            found[parent].append(joint)
    return found


def _depth_first(children: list[list[int]]) -> list[int]:
    found, waiting = [], [0]
    while waiting:
        joint = waiting.pop()
        found.append(joint)
        waiting += reversed(children[joint])
    return found


def _joint(skeleton: Skeleton, children: list[list[int]], joint: int, indent: str) -> list[str]:
    """Return the lines of a joint and its descendants."""
    deeper = indent + "\t"
    kind = "JOINT" if skeleton.parents[joint] >= 0 else "ROOT"
    order = skeleton.orders.get(joint, ORDER)
    names = [f"{axis.upper()}rotation" for axis in order]
    if joint in skeleton.moves:
        names = [f"{axis}position" for axis in "XYZ"] + names
    lines = [f"{indent}{kind} {skeleton.names[joint]}", f"{indent}{{"]
    moved_below_the_root = joint in skeleton.moves and skeleton.parents[joint] >= 0
    offset = np.zeros(3) if moved_below_the_root else skeleton.offsets[joint]
    lines += [deeper + _offset(offset), f"{deeper}CHANNELS {len(names)} {' '.join(names)}"]
    for child in children[joint]:
        lines += _joint(skeleton, children, child, deeper)
    end = skeleton.ends.get(joint)
    if end is None and not children[joint]:
        # programs want an end for each chain
        end = _STUB * np.ptp(skeleton.world[0][0]) * np.array([0.0, 1.0, 0.0])
    if end is not None:
        lines += [f"{deeper}End Site", f"{deeper}{{", f"{deeper}\t{_offset(end)}", f"{deeper}}}"]
    return [*lines, f"{indent}}}"]


def _offset(offset: Array) -> str:
    x, y, z = offset
    return f"OFFSET {x:.6f} {y:.6f} {z:.6f}"

"""The tracked box of a recording as the box of a clip: its axes named, and when it is held."""

import itertools

import numpy as np
from scipy.spatial.transform import Rotation

from world.motions.fit.poses import stretches
from world.motions.formats.recording import RecordedBox
from world.motions.objects import BoxTrack
from world.motions.retarget.body import Array, Targets

#: A box is lifted where its lowest corner is this far above where it rests, m.
_LIFTED_M = 0.02
#: Wrists hold a box whose surface is nearer than this, m: a hand is between.
_NEAR_M = 0.2
#: Before and after it is lifted, a box is held while the wrists keep their place at it within this,
#: m.
_KEPT_M = 0.03


def track(box: RecordedBox, target: Targets, drop: Array) -> BoxTrack:
    """The box's track among the targets of the bodies.

    Args:
        drop: [3] m, by which the joints were lowered onto the character's feet: the box is lowered
            with the hands, but not into the floor.
    """
    hands = target.hand + drop
    held = _held(box, hands)
    axes = _named(box, hands, held)
    rotation, size = box.rotation @ axes, np.abs(np.array(box.size_m) @ axes)
    position = box.position - drop
    reach = 0.5 * np.abs(rotation[:, 2]) @ size
    position[:, 2] = np.maximum(position[:, 2], reach)
    quaternion = Rotation.from_matrix(rotation).as_quat(scalar_first=True)
    pose = np.concatenate((position, quaternion), axis=1).astype(np.float32)
    x, y, z = (float(edge) for edge in size)
    return BoxTrack(pose, (x, y, z), held)


def _held(box: RecordedBox, hands: Array) -> Array:
    """[T] bool: the box is in both hands [T, 2, 3]."""
    at = np.einsum("tji,thj->thi", box.rotation, hands - box.position[:, None])
    away = np.maximum(np.abs(at) - 0.5 * np.array(box.size_m), 0)
    near = (np.linalg.norm(away, axis=-1) < _NEAR_M).all(axis=1)
    low = box.position[:, 2] - 0.5 * np.abs(box.rotation[:, 2]) @ np.array(box.size_m)
    lifted = near & (low > low.min() + _LIFTED_M)
    held = lifted.copy()
    for start, stop in stretches(lifted):
        first, last = start, stop
        while first > 0 and np.abs(at[first - 1] - at[start]).max() < _KEPT_M and near[first - 1]:
            first -= 1
        while last < len(at) and np.abs(at[last] - at[stop - 1]).max() < _KEPT_M and near[last]:
            last += 1
        # it stands still before it is lifted: the hands hold it from the frame before
        held[max(first, start - 3) : min(last, stop + 3)] = True
    return held


def _named(box: RecordedBox, hands: Array, held: Array) -> Array:
    """[3, 3]: a signed permutation by which the box's axes become x away from the person, y between
    the hands, z up."""
    frames = np.flatnonzero(held) if held.any() else np.arange(len(held))
    line = (hands[:, 1] - hands[:, 0])[frames]
    line /= np.maximum(np.linalg.norm(line, axis=1, keepdims=True), 1e-9)
    best, axes = -np.inf, np.eye(3)
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((-1.0, 1.0), repeat=3):
            one = np.zeros((3, 3))
            one[order, range(3)] = signs
            if np.linalg.det(one) < 0:
                continue
            turned = box.rotation[frames] @ one
            # upright counts above all: a box is square to the hands by its choice of x and y
            fit = 4 * turned[:, 2, 2].mean() + np.sum(turned[:, :, 1] * line, axis=1).mean()
            if fit > best:
                best, axes = fit, one
    return axes

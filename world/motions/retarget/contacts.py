"""Foot contacts: where recorded soles rest on the floor, the targets' soles are flat and still."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import binary_closing, binary_opening, gaussian_filter1d
from scipy.spatial.transform import Rotation

from world.character.soles import ANKLE_M, HALF_WIDTH_M, HEEL_M, TOE_M
from world.motions.retarget.body import Array, Targets

#: Radius of the hand's sphere.
HAND_M = 0.04
#: A point of the sole that is slower and lower than this stands on the floor: m/s, m.
STANDS_M_S, STANDS_M = 0.35, 0.03
#: A foot with both ends standing that is level within this is flat: a lifting heel is not pressed
#: down.
_FLAT_RAD = np.deg2rad(5.0)
#: Uneven floor is corrected within this of the clip's level, m, smoothed over this time, s:
#: captures are tilted and drift.
_UNEVEN_M, _UNEVEN_S = 0.12, 0.5
#: Frames over which a foot blends into and out of standing.
_BLEND_FRAMES = 2.0
#: Frames over which the correction fades where a foot does not stand again.
_LET_GO_FRAMES = 12


@dataclass(frozen=True)
class Contact:
    """Standing ends of the soles: T frames, right and left."""

    heel: Array
    """[T, 2] bool."""
    toe: Array
    """[T, 2] bool."""
    flat: Array
    """[T, 2] bool: both ends stand and the sole is level."""


def sole_ends(ankle: Array, foot: Array) -> Array:
    """Centres of the heel's and the toe's edge [..., 2, 3] m for ankles [..., 3] and feet
    [..., 3, 3]."""
    ends = np.array([[HEEL_M, 0, -ANKLE_M], [TOE_M, 0, -ANKLE_M]])
    return ankle[..., None, :] + np.einsum("...ij,cj->...ci", foot, ends)


def sole_corners(ankle: Array, foot: Array) -> Array:
    """The four corners of soles [..., 4, 3]."""
    corners = np.array(
        [[x, y, -ANKLE_M] for x in (HEEL_M, TOE_M) for y in (-HALF_WIDTH_M, HALF_WIDTH_M)]
    )
    return ankle[..., None, :] + np.einsum("...ij,cj->...ci", foot, corners)


def find(target: Targets, fps: int) -> Contact:
    """The contacts of the targets' soles with the floor at z = 0."""
    feet = target.rotation[:, [11, 14]]
    ends = sole_ends(target.ankle, feet)
    ground = np.linalg.norm(np.gradient(ends[..., :2], axis=0), axis=-1) * fps
    stands = (ground < STANDS_M_S) & (ends[..., 2] < STANDS_M)
    structure = np.ones((3, 1, 1), bool)
    stands = binary_opening(binary_closing(stands, structure), structure)
    level = np.arccos(np.clip(feet[..., 2, 2], -1, 1)) < _FLAT_RAD
    return Contact(stands[..., 0], stands[..., 1], stands.all(axis=-1) & level)


def uneven_floor(target: Targets, fps: int) -> Array:
    """Height [T] m of the floor below the targets' flat feet, smoothed; 0 without any."""
    feet = target.rotation[:, [11, 14]]
    ends = sole_ends(target.ankle, feet)
    ground = np.linalg.norm(np.gradient(ends, axis=0), axis=-1).max(axis=-1) * fps
    height = sole_corners(target.ankle, feet)[..., 2].min(axis=-1)
    level = np.arccos(np.clip(feet[..., 2, 2], -1, 1)) < _FLAT_RAD
    stands = (ground < STANDS_M_S) & level & (np.abs(height) < _UNEVEN_M)
    frames = np.arange(len(height))
    at, _ = np.nonzero(stands)
    if not len(at):
        return np.zeros(len(height))
    away = (frames[:, None] - at[None, :]) / (_UNEVEN_S * fps)
    # far from all stances the nearest one decides: subtract the smallest exponent
    exponent = -0.5 * away**2
    weight = np.exp(exponent - exponent.max(axis=1, keepdims=True))
    return (weight @ height[stands]) / weight.sum(axis=1)


def stretches(mask: Array) -> list[tuple[int, int]]:
    """(first, one beyond last) of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def held(target: Targets, contact: Contact) -> Targets:
    """The targets with standing feet flat, still and on the floor, and swings blended to them."""
    rotation, ankle = target.rotation.copy(), target.ankle.copy()
    for side, body in enumerate((11, 14)):
        foot = _levelled(rotation[:, body], contact.flat[:, side])
        rotation[:, body] = foot
        ankle[:, side] += _shift(
            ankle[:, side], foot, contact.heel[:, side], contact.toe[:, side],
            contact.flat[:, side],
        )  # fmt: skip
        low = sole_corners(ankle[:, side], foot)[..., 2].min(axis=-1)
        ankle[:, side, 2] -= np.minimum(low, 0)
    hand = target.hand.copy()
    hand[..., 2] = np.maximum(hand[..., 2], HAND_M)
    return replace(target, rotation=rotation, ankle=ankle, hand=hand)


def _levelled(foot: Array, flat: Array) -> Array:
    """Rotations [T, 3, 3] of a foot, level and with constant yaw where it is flat."""
    wanted = foot.copy()
    for start, stop in stretches(flat):
        ahead = foot[start:stop, :2, 0].mean(axis=0)
        yaw = np.arctan2(ahead[1], ahead[0])
        wanted[start:stop] = Rotation.from_euler("z", yaw).as_matrix()
    fraction = _eased(flat)
    # elsewhere a foot blends towards its nearest standing rotation
    near = _nearest_in(flat)
    if near is None:
        return foot
    turned = Rotation.from_matrix(np.swapaxes(foot, -1, -2) @ wanted[near]).as_rotvec()
    return foot @ Rotation.from_rotvec(turned * fraction[:, None]).as_matrix()


def _eased(mask: Array) -> Array:
    """[T]: 1 in the mask, decaying within a few frames outside it."""
    distance = np.full(len(mask), np.inf)
    for start, stop in stretches(mask):
        frames = np.arange(len(mask))
        away = np.maximum(np.maximum(start - frames, frames - (stop - 1)), 0)
        distance = np.minimum(distance, away)
    return np.exp(-0.5 * (distance / _BLEND_FRAMES) ** 2)


def _nearest_in(mask: Array) -> Array | None:
    """[T]: the nearest frame of the mask; None for an empty mask."""
    inside = np.flatnonzero(mask)
    if not len(inside):
        return None
    frames = np.arange(len(mask))
    right = np.searchsorted(inside, frames).clip(0, len(inside) - 1)
    left = (right - 1).clip(0)
    nearer = np.abs(inside[left] - frames) < np.abs(inside[right] - frames)
    return np.where(nearer, inside[left], inside[right])


def _shift(ankle: Array, foot: Array, heel: Array, toe: Array, flat: Array) -> Array:
    """Shift of the ankle [T, 3] m by which standing ends stay in place."""
    ends = sole_ends(ankle, foot)
    shift = np.full_like(ankle, np.nan)
    for start, stop in stretches(heel | toe):
        here = slice(start, stop)
        level = flat[here]
        if level.any():
            centre = ends[here].mean(axis=1)[level]
            at = np.median(centre, axis=0)
            ahead = foot[here][level][0][:, 0]
            half = 0.5 * (TOE_M - HEEL_M)
            anchors = np.stack([at - half * ahead, at + half * ahead])
        else:
            anchors = np.stack([_median(ends[here, k], mask[here])
                                for k, mask in ((0, heel), (1, toe))])  # fmt: skip
        by_end = anchors[None, :, :2] - ends[here, :, :2]
        both = np.stack([heel[here], toe[here]], axis=-1).astype(float)
        both[level] = 1.0
        move = np.zeros((stop - start, 3))
        move[:, :2] = (by_end * both[..., None]).sum(axis=1) / both.sum(axis=1)[:, None]
        lowest = sole_corners(ankle[here], foot[here])[..., 2].min(axis=-1)
        move[:, 2] = -lowest
        shift[here] = move
    known = ~np.isnan(shift[:, 0])
    if not known.any():
        return np.zeros_like(ankle)
    frames = np.arange(len(ankle))
    # before the first stance and after the last one the shift fades
    ends = np.flatnonzero(known)[[0, -1]] + np.array([-1, 1]) * _LET_GO_FRAMES
    at = np.concatenate((ends[:1], frames[known], ends[1:]))
    zero = np.zeros((1, 3))
    held = np.concatenate((zero, shift[known], zero))
    joined = np.stack([np.interp(frames, at, column) for column in held.T], axis=-1)
    smooth = gaussian_filter1d(joined, 1.0, axis=0, mode="nearest")
    fraction = np.where(flat, 0.0, 1.0)[:, None]
    # exact where the foot is flat, smoothed elsewhere
    return joined * (1 - fraction) + smooth * fraction


def _median(points: Array, mask: Array) -> Array:
    chosen = points[mask] if mask.any() else points
    return np.median(chosen, axis=0)

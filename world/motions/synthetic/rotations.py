"""Rotation matrices and quaternions in numpy, over any leading axes."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def about(axis: str, angle_rad: Array | float) -> Array:
    """Rotation matrices [..., 3, 3] about "x", "y" or "z" by angles [...] (right-handed)."""
    angle = np.asarray(angle_rad, dtype=np.float64)
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    matrix = np.zeros((*angle.shape, 3, 3))
    matrix[..., i, i] = 1.0
    matrix[..., j, j] = matrix[..., k, k] = np.cos(angle)
    matrix[..., k, j] = np.sin(angle)
    matrix[..., j, k] = -np.sin(angle)
    return matrix


def turn(matrix: Array, vector: Array) -> Array:
    """Vectors [..., 3] turned by matrices [..., 3, 3]."""
    return np.einsum("...ij,...j->...i", matrix, vector)


def transpose(matrix: Array) -> Array:
    """The inverse of rotation matrices [..., 3, 3]."""
    return np.swapaxes(matrix, -1, -2)


def quaternion(matrix: Array) -> Array:
    """Quaternions [T, ..., 4] (w, x, y, z) of matrices [T, ..., 3, 3], continuous along T.

    Bar-Itzhack's form: each takes the one of four expressions with the largest pivot.
    """
    m = matrix
    xx, yy, zz = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    pivots = np.stack([xx + yy + zz, xx - yy - zz, yy - xx - zz, zz - xx - yy], -1) + 1.0
    zy, xz, yx = (
        m[..., 2, 1] - m[..., 1, 2],
        m[..., 0, 2] - m[..., 2, 0],
        m[..., 1, 0] - m[..., 0, 1],
    )
    sxy, sxz, syz = (
        m[..., 1, 0] + m[..., 0, 1],
        m[..., 0, 2] + m[..., 2, 0],
        m[..., 2, 1] + m[..., 1, 2],
    )
    rows = np.stack(
        [
            np.stack([pivots[..., 0], zy, xz, yx], -1),
            np.stack([zy, pivots[..., 1], sxy, sxz], -1),
            np.stack([xz, sxy, pivots[..., 2], syz], -1),
            np.stack([yx, sxz, syz, pivots[..., 3]], -1),
        ],
        -2,
    )
    best = np.argmax(pivots, -1)[..., None, None]
    q = np.take_along_axis(rows, best, -2)[..., 0, :]
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    flips = np.where(np.sum(q[1:] * q[:-1], -1, keepdims=True) < 0, -1.0, 1.0)
    first = np.where(q[:1, ..., :1] < 0, -1.0, 1.0)
    return q * np.cumprod(np.concatenate([first, flips]), axis=0)


def matrix(quaternions: Array) -> Array:
    """Matrices [..., 3, 3] of unit quaternions [..., 4] (w, x, y, z)."""
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], -1),
            np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], -1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], -1),
        ],
        -2,
    )


def blend(first: Array, second: Array, weight: Array) -> Array:
    """Matrices [T, 3, 3] part of the way from `first` to `second`, weights [T] in 0..1.

    Normalised linear interpolation of quaternions: exact at both ends and smooth between.
    """
    a, b = quaternion(first), quaternion(second)
    b = np.where(np.sum(a * b, -1, keepdims=True) < 0, -b, b)
    q = a + weight[:, None] * (b - a)
    return matrix(q / np.linalg.norm(q, axis=-1, keepdims=True))


def rotation_vector(quaternions: Array) -> Array:
    """Exponential-map coordinates [..., 3] (rad) of unit quaternions [..., 4], |angle| <= pi."""
    q = np.where(quaternions[..., :1] < 0, -quaternions, quaternions)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, q[..., :1])
    return q[..., 1:] * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-9), 2.0)

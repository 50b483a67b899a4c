"""Batched rotations in torch: quaternions in MuJoCo's order (w, x, y, z), and headings.

Our own code, since batched libraries are scalar-last, and these run in every control step.
"""

import torch
from torch import Tensor

from world import vector_math  # noqa: F401  # pyright: ignore[reportUnusedImport]


def multiply(a: Tensor, b: Tensor) -> Tensor:
    """Hamilton product a·b of quaternions [..., 4]: first b, then a."""
    aw, ax, ay, az = a.unbind(-1)
    bw, bx, by, bz = b.unbind(-1)
    return torch.stack(
        (
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ),
        dim=-1,
    )


def conjugate(q: Tensor) -> Tensor:
    """The inverse rotation of unit quaternions [..., 4]."""
    return q * q.new_tensor((1.0, -1.0, -1.0, -1.0))


def matrix(q: Tensor) -> Tensor:
    """Rotation matrices [..., 3, 3] of unit quaternions [..., 4]."""
    w, x, y, z = q.unbind(-1)
    x2, y2, z2 = 2 * x, 2 * y, 2 * z
    xx, yy, zz = x * x2, y * y2, z * z2
    xy, xz, yz = x * y2, x * z2, y * z2
    wx, wy, wz = w * x2, w * y2, w * z2
    entries = (
        *(1 - (yy + zz), xy - wz, xz + wy),
        *(xy + wz, 1 - (xx + zz), yz - wx),
        *(xz - wy, yz + wx, 1 - (xx + yy)),
    )
    return torch.stack(entries, dim=-1).unflatten(-1, (3, 3))


def normalise(q: Tensor) -> Tensor:
    """Quaternions [..., 4] at unit length."""
    return q / q.norm(dim=-1, keepdim=True)


def heading(q: Tensor) -> Tensor:
    """Cosine and sine of the heading of rotations [..., 4]: their twist about z, [..., 2].

    The twist is continuous through sitting and lying on the back, where the projection of the
    forward axis (published code) turns round. It is undefined only upside down, where it is 0.
    """
    w, z = q[..., 0], q[..., 3]
    square = w * w + z * z
    safe = square > 1e-8
    square = torch.where(safe, square, torch.ones_like(square))
    cos = torch.where(safe, (w * w - z * z) / square, torch.ones_like(w))
    sin = torch.where(safe, 2 * w * z / square, torch.zeros_like(w))
    return torch.stack((cos, sin), dim=-1)


def cos_sin(angle: Tensor) -> Tensor:
    """[..., 2]: cosines and sines of angles [...], rad."""
    return torch.stack((angle.cos(), angle.sin()), dim=-1)


def yaw(cos_sin: Tensor) -> Tensor:
    """[...]: angles of cosines and sines [..., 2], rad."""
    return torch.atan2(cos_sin[..., 1], cos_sin[..., 0])


def from_heading(cos_sin: Tensor) -> Tensor:
    """Rotations [..., 4] about z by the angle of the given cosine and sine [..., 2], by half-angle
    formulas, exact without trigonometry."""
    cos, sin = cos_sin.unbind(-1)
    w = torch.sqrt((0.5 * (1 + cos)).clamp_min(0.0))
    z = torch.sqrt((0.5 * (1 - cos)).clamp_min(0.0)) * torch.where(sin < 0, -1.0, 1.0)
    return normalise(torch.stack((w, torch.zeros_like(w), torch.zeros_like(w), z), dim=-1))


def turn(cos_sin: Tensor, v: Tensor) -> Tensor:
    """Vectors v [..., 2 or 3] turned about z by the angle of the given cosine and sine [..., 2]."""
    c, s = cos_sin.unbind(-1)
    x, y = v[..., 0], v[..., 1]
    out = [c * x - s * y, s * x + c * y]
    if v.shape[-1] == 3:
        out.append(v[..., 2].expand_as(out[0]))
    return torch.stack(out, dim=-1)


def turn_back(cos_sin: Tensor, v: Tensor) -> Tensor:
    """`turn` by the opposite angle: world vectors in a heading frame."""
    return turn(cos_sin * cos_sin.new_tensor((1.0, -1.0)), v)


def to_rotation_vector(q: Tensor) -> Tensor:
    """Rotation vectors (axis times angle in [0, π], rad) of unit quaternions [..., 4]: [..., 3]."""
    q = torch.where(q[..., :1] < 0, -q, q)
    v = q[..., 1:]
    sine = v.norm(dim=-1, keepdim=True)
    angle = 2 * torch.atan2(sine, q[..., :1])
    # angle / sine tends to 2 / w, near which the division loses its digits
    scale = torch.where(sine > 1e-6, angle / sine.clamp_min(1e-12), 2.0 / q[..., :1])
    return v * scale


def from_rotation_vector(v: Tensor) -> Tensor:
    """Unit quaternions [..., 4] of rotation vectors [..., 3], rad; inverse of
    `to_rotation_vector`."""
    half = 0.5 * v.norm(dim=-1, keepdim=True)
    # sin(x) / x, which is 1 at 0
    return torch.cat((half.cos(), 0.5 * v * torch.sinc(half / torch.pi)), dim=-1)


def from_matrix(m: Tensor) -> Tensor:
    """Unit quaternions [..., 4] of rotation matrices [..., 3, 3], by their largest component."""
    diagonal = torch.stack(
        (
            1.0 + m[..., 0, 0] + m[..., 1, 1] + m[..., 2, 2],
            1.0 + m[..., 0, 0] - m[..., 1, 1] - m[..., 2, 2],
            1.0 - m[..., 0, 0] + m[..., 1, 1] - m[..., 2, 2],
            1.0 - m[..., 0, 0] - m[..., 1, 1] + m[..., 2, 2],
        ),
        dim=-1,
    )
    wx, wy, wz = (m[..., i, j] - m[..., j, i] for i, j in ((2, 1), (0, 2), (1, 0)))
    xy, xz, yz = (m[..., i, j] + m[..., j, i] for i, j in ((0, 1), (0, 2), (1, 2)))
    w, x, y, z = diagonal.unbind(-1)
    # row k is the quaternion times four times its component k
    rows = torch.stack((w, wx, wy, wz, wx, x, xy, xz, wy, xy, y, yz, wz, xz, yz, z), dim=-1)
    rows = rows.unflatten(-1, (4, 4))
    largest = diagonal.argmax(dim=-1)[..., None, None].expand(*m.shape[:-2], 1, 4)
    return normalise(rows.gather(-2, largest)[..., 0, :])

"""Whole-body inverse kinematics: positions, masses and Jacobians of the character, and the least
squares that turns tasks in space into servo set-points.

Resolved-rate inverse kinematics (Whitney 1969) with damping (Nakamura & Hanafusa 1986) over the 34
velocities of the floating character. Each task asks for a small move of a point. A servo's
set-point is its position plus its share of the move plus the feed-forward torque divided by its
stiffness. The load is quasi-static: the whole mass at its centre, against the forces at feet and
hands. float64 throughout.
"""

from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from world import rotations
from world.character import kinematics, servos
from world.character import model as character

GRAVITY_M_S2 = 9.81
DOFS = character.NV
_BODIES = len(character.BODIES)
#: Damping of the least squares, in the unit of the weighted rows. Without it the joints move by
#: large angles for a few millimetres near a stretched knee or elbow.
_DAMPING = 0.15
#: Largest step of a servo's set-point, rad.
_STEP_RAD = 0.5


def _masses() -> tuple[Tensor, Tensor]:
    """Mass of each body, kg [15], and its centre in the body's frame, m [15, 3]."""
    model = character.spec().compile()
    return torch.tensor(model.body_mass[1:]), torch.tensor(model.body_ipos[1:])


def _subtrees() -> Tensor:
    """[15, 15]: 1 where the second body is the first or descends from it."""
    table = torch.eye(_BODIES, dtype=torch.float64)
    for body, parent in enumerate(character.PARENTS):
        if parent >= 0:
            table[:, body] += table[:, parent]
    return table


def _servo_axes() -> tuple[Tensor, Tensor]:
    """Of each of the 28 servos: the body that it turns [28], and its axis in that body's frame
    [28, 3]."""
    bodies, axes = [], []
    signs = iter(character.HINGE_SIGN)
    for body, joint in zip(character.JOINT_BODIES, character.JOINTS, strict=True):
        own = torch.eye(3).tolist() if joint.is_ball else [[0.0, next(signs), 0.0]]
        bodies += [body] * len(own)
        axes += own
    return torch.tensor(bodies), torch.tensor(axes, dtype=torch.float64)


_KG, _CENTRE = _masses()
_SUBTREE = _subtrees()
_SUBTREE_KG = _SUBTREE @ _KG
#: Mass of the character, kg.
BODY_KG = float(_KG.sum())
_TURNED, _AXIS = _servo_axes()
_KP = torch.from_numpy(character.gains()[0])
_LOW, _HIGH = (torch.from_numpy(bound) for bound in character.set_point_bounds())


@dataclass(frozen=True)
class Figure:
    """The kinematic state of the character in n scenes; world frame, m, s, rad.

    Jacobians [n, 3, 34] have the columns of MuJoCo's velocities, except that the root turns about
    the world's axes instead of its own.
    """

    qpos: Tensor
    """[n, 43]."""
    velocity: Tensor
    """[n, 34]: of the columns of the Jacobians."""
    position: Tensor
    """[n, 15, 3]: of the bodies' frames."""
    rotation: Tensor
    """[n, 15, 3, 3]: likewise."""

    @staticmethod
    def of(qpos: Tensor, qvel: Tensor) -> "Figure":
        """The figure at MuJoCo's coordinates [n, 43] and velocities [n, 34]."""
        qpos, velocity = qpos.double(), qvel.double().clone()
        local = rotations.matrix(kinematics.local_rotations(qpos))
        position, rotation = kinematics.forward(qpos[:, :3], local)
        velocity[:, 3:6] = apply(rotation[:, 0], velocity[:, 3:6])
        return Figure(qpos, velocity, position, rotation)

    @cached_property
    def _axes(self) -> Tensor:
        """[n, 28, 3]: of the servos."""
        return apply(self.rotation[:, _TURNED], _AXIS)

    @cached_property
    def _centres(self) -> Tensor:
        """[n, 15, 3]: centre of mass of the subtree of each body."""
        own = self.position + apply(self.rotation, _CENTRE)
        return (_SUBTREE * _KG) @ own / _SUBTREE_KG[:, None]

    @property
    def com(self) -> Tensor:
        """[n, 3]: centre of mass of the character."""
        return self._centres[:, 0]

    @cached_property
    def com_velocity(self) -> Tensor:
        """[n, 3], m/s."""
        return apply(self.com_jacobian, self.velocity)

    @cached_property
    def com_jacobian(self) -> Tensor:
        """[n, 3, 34]: each joint moves the share of the mass in its subtree."""
        arms = self._centres[:, _TURNED] - self.position[:, _TURNED]
        share = (_SUBTREE_KG[_TURNED] / BODY_KG)[:, None]
        return self._jacobian(self.com, torch.linalg.cross(self._axes, arms) * share)

    def point_jacobian(self, body: int, point: Tensor | None = None) -> Tensor:
        """[n, 3, 34]: of a point [n, 3] fixed to a body; default: the origin of the body's
        frame."""
        point = self.position[:, body] if point is None else point
        arms = torch.linalg.cross(self._axes, point[:, None] - self.position[:, _TURNED])
        return self._jacobian(point, arms * _SUBTREE[_TURNED, body][:, None])

    def turning_jacobian(self, body: int) -> Tensor:
        """[n, 3, 34]: of a body's angular velocity about the world's axes."""
        jacobian = self.qpos.new_zeros(len(self.qpos), 3, DOFS)
        jacobian[:, :, 3:6] = torch.eye(3, dtype=self.qpos.dtype)
        jacobian[:, :, 6:] = (self._axes * _SUBTREE[_TURNED, body][:, None]).transpose(1, 2)
        return jacobian

    def _jacobian(self, point: Tensor, joints: Tensor) -> Tensor:
        """[n, 3, 34]: of a point [n, 3] that moves with the root, and with joints [n, 28, 3]."""
        jacobian = self.qpos.new_zeros(len(self.qpos), 3, DOFS)
        unit = torch.eye(3, dtype=self.qpos.dtype)
        jacobian[:, :, :3] = unit
        # column k: the cross product of the k-th axis and the arm
        arm = (point - self.position[:, 0])[:, None].expand(-1, 3, -1)
        jacobian[:, :, 3:6] = torch.linalg.cross(unit.expand_as(arm), arm).transpose(1, 2)
        jacobian[:, :, 6:] = joints.transpose(1, 2)
        return jacobian


@dataclass(frozen=True)
class Load:
    """The load in the hands."""

    mass_kg: Tensor
    """[n]: 0 where there is none."""
    position: Tensor
    """[n, 3]: its centre, m."""


@dataclass(frozen=True)
class Mass:
    """The mass that the feet support, load included."""

    mass_kg: Tensor
    """[n]."""
    position: Tensor
    """[n, 2]: its centre, projected on the floor, m."""
    velocity: Tensor
    """[n, 2]: of the character alone, m/s; the velocity of the load is not used."""

    @staticmethod
    def of(figure: Figure, load: Load) -> "Mass":
        """The combined mass of the character and its load."""
        mass_kg = BODY_KG + load.mass_kg
        centre = BODY_KG * figure.com + load.mass_kg[:, None] * load.position
        return Mass(mass_kg, (centre / mass_kg[:, None])[:, :2], figure.com_velocity[:, :2])


class Tasks:
    """Requested moves of the body, each with its weight."""

    def __init__(self) -> None:
        self._rows: list[Tensor] = []
        self._wanted: list[Tensor] = []

    def add(self, jacobian: Tensor, wanted: Tensor, weight: float | Tensor) -> None:
        """Request a move `wanted` [n, k] m or rad of the quantity with this Jacobian [n, k, 34].

        weight: a number, one per scene [n], or one per row [n, k].
        """
        factor = torch.as_tensor(weight, dtype=wanted.dtype)
        factor = factor[:, None] if factor.dim() == 1 else factor
        self._rows.append(jacobian * factor[..., None])
        self._wanted.append(wanted * factor)

    def solve(self) -> Tensor:
        """The move [n, 34] that minimises the weighted, damped squares."""
        rows, wanted = torch.cat(self._rows, dim=1), torch.cat(self._wanted, dim=1)
        across = rows.transpose(1, 2)
        square = across @ rows + _DAMPING**2 * torch.eye(DOFS, dtype=rows.dtype)
        return torch.linalg.solve(square, apply(across, wanted))


def moments(jacobian: Tensor, force: Tensor) -> Tensor:
    """[n, 34]: joint torques, N·m, with which a point with this Jacobian [n, 3, 34] exerts `force`
    [n, 3] N."""
    return apply(jacobian.transpose(1, 2), force)


def set_points(figure: Figure, move: Tensor, effort: Tensor, gain: Tensor) -> Tensor:
    """Servo set-points [n, 28] rad, within their bounds: the present position plus `gain` [n] times
    the move [n, 34], plus the offset that exerts the effort [n, 34] N·m."""
    step = move[:, 6:].clamp(-_STEP_RAD, _STEP_RAD)
    wanted = servos.coordinates(figure.qpos) + gain[:, None] * step + effort[:, 6:] / _KP
    return torch.maximum(torch.minimum(wanted, _HIGH), _LOW)


def apply(matrix: Tensor, vector: Tensor) -> Tensor:
    """Product [..., k] of matrices [..., k, m] and vectors [..., m]."""
    return (matrix @ vector[..., None])[..., 0]


def shortened(way: Tensor, most: float) -> Tensor:
    """Vectors [n, k] cut to a length of at most `most`."""
    return way * (most / way.norm(dim=1, keepdim=True).clamp_min(most))


def attitude(heading: Tensor, pitch_rad: Tensor) -> Tensor:
    """[n, 3, 3]: rotations that face along a heading [n, 2] (cosine, sine), pitched forward by
    [n] rad."""
    cos, sin = heading.unbind(1)
    down, zero = pitch_rad.sin(), torch.zeros_like(cos)
    level = pitch_rad.cos()
    entries = (cos * level, -sin, cos * down, sin * level, cos, sin * down, -down, zero, level)
    return torch.stack(entries, dim=1).unflatten(1, (3, 3))


def rotation_error(rotation: Tensor, wanted: Tensor) -> Tensor:
    """[n, 3]: the rotation vector, rad, world, from rotations [n, 3, 3] to wanted ones."""
    error = rotations.from_matrix(wanted @ rotation.transpose(1, 2))
    return rotations.to_rotation_vector(error)

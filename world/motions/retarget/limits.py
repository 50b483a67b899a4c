"""Limits of the inverse kinematics: joint ranges, and the floor."""

import mink
import mujoco
import numpy as np

from world.character import model as character

#: Points of the body up to this height above the floor are constrained, m.
_NEAR_FLOOR_M = 0.08


class JointRanges(mink.Limit):
    """Bounds of each axis of each joint: those of its set-points.

    Ball joints are bounded axis by axis on their rotation vector, which MuJoCo's own cone limit
    cannot: r(q exp(w)) = r(q) + J(r) w, J being the inverse of SO(3)'s right Jacobian (Solà, Deray
    and Atchuthan 2018, "A micro Lie theory", equation 144).
    """

    def __init__(self) -> None:
        low, high = character.set_point_bounds()
        self._rows, ball, hinge = np.zeros((character.NU, character.NV)), [], []
        row = 0
        for joint in character.JOINTS:
            (ball if joint.is_ball else hinge).append(row)
            row += len(joint.range_deg)
        self._ball = np.array([np.arange(r, r + 3) for r in ball])
        self._hinge = np.array(hinge)
        self._low, self._high = low, high

    def compute_qp_inequalities(
        self, configuration: mink.Configuration, dt: float
    ) -> mink.Constraint:
        """G dq <= h with both bounds of all 28 axes; where a range is exceeded, the step returns to
        it."""
        del dt
        vector, inverse = axes(configuration.q)
        angle = np.empty(character.NU)
        rows = self._rows
        for index, dof in enumerate(character.BALL_DOF):
            angle[self._ball[index]] = vector[index]
            rows[self._ball[index], dof : dof + 3] = inverse[index]
        angle[self._hinge] = configuration.q[list(character.HINGE_QPOS)]
        rows[self._hinge, list(character.HINGE_DOF)] = 1.0
        return mink.Constraint(
            np.vstack((rows, -rows)), np.concatenate((self._high - angle, angle - self._low))
        )


def axes(qpos: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotation vectors [8, 3] rad of the ball joints of qpos [43], and their J [8, 3, 3]."""
    q = np.stack([qpos[a : a + 4] for a in character.BALL_QPOS])
    q = q * np.where(q[:, :1] < 0, -1.0, 1.0)
    sine = np.linalg.norm(q[:, 1:], axis=1)
    angle = 2 * np.arctan2(sine, q[:, 0])
    small = sine < 1e-6
    vector = q[:, 1:] * np.where(small, 2.0, angle / np.where(small, 1.0, sine))[:, None]
    safe = np.where(small, 1.0, angle)
    last = 1 / safe**2 - (1 + np.cos(safe)) / (2 * safe * np.sin(np.minimum(safe, np.pi - 1e-3)))
    last = np.where(small, 1.0 / 12.0, last)
    cross = np.zeros((len(q), 3, 3))
    x, y, z = vector.T
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -z, y, -x
    cross -= np.swapaxes(cross, 1, 2)
    return vector, np.eye(3) + 0.5 * cross + last[:, None, None] * (cross @ cross)


def shape_points(model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Candidate lowest points of the character's shapes: body ids [P], positions [P, 3] m in the
    body's frame, radii [P] m; ends of capsules, centres of spheres, corners of boxes."""
    bodies, points, radii = [], [], []
    for geom in range(model.ngeom):
        body = model.geom_bodyid[geom]
        if body == 0:
            continue
        turn = np.empty(9)
        mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
        turn, size = turn.reshape(3, 3), model.geom_size[geom]
        kind = model.geom_type[geom]
        if kind == mujoco.mjtGeom.mjGEOM_BOX:
            offsets = [np.array([x, y, z]) * size for x in (-1, 1) for y in (-1, 1)
                       for z in (-1, 1)]  # fmt: skip
            radius = 0.0
        elif kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
            offsets, radius = [np.array([0, 0, s * size[1]]) for s in (-1, 1)], size[0]
        else:
            offsets, radius = [np.zeros(3)], size[0]
        for offset in offsets:
            bodies.append(body)
            points.append(model.geom_pos[geom] + turn @ offset)
            radii.append(radius)
    return np.array(bodies), np.array(points), np.array(radii)


class AboveFloor(mink.Limit):
    """The character's shapes must be above z = 0."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._bodies, self._points, self._radii = shape_points(model)

    def heights(self, data: mujoco.MjData) -> np.ndarray:
        """Height [P] of the lowest point of each sphere about a shape point, m."""
        turn = data.xmat.reshape(-1, 3, 3)[self._bodies, 2]
        return data.xpos[self._bodies, 2] + np.sum(turn * self._points, axis=1) - self._radii

    def compute_qp_inequalities(
        self, configuration: mink.Configuration, dt: float
    ) -> mink.Constraint:
        """G dq <= h that keeps the points near the floor above it."""
        del dt
        data, model = configuration.data, configuration.model
        height = self.heights(data)
        near = np.flatnonzero(height < _NEAR_FLOOR_M)
        if not len(near):
            return mink.Constraint()
        turn = data.xmat.reshape(-1, 3, 3)
        rows, jacobian = np.empty((len(near), model.nv)), np.empty((3, model.nv))
        for row, index in enumerate(near):
            body = self._bodies[index]
            point = data.xpos[body] + turn[body] @ self._points[index]
            mujoco.mj_jac(model, data, jacobian, None, point, body)
            rows[row] = -jacobian[2]
        return mink.Constraint(rows, height[near])

"""A helping hand that brings a character to its feet: no shipped policy stands up.

A bounded force and torque at the pelvis follow a path, critically damped, while the servos hold the
pose of standing. The simulation goes on: nothing is reset, and what is in the way is touched.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from world.character import model as character

Vector = NDArray[np.float64]
#: Height of the root of a standing character, m.
STANDING_M = float(character.standing_qpos()[2])
#: Mass, kg, and moment of inertia about the pelvis with straight legs, kg m², of the character.
_KG = float(sum(character.spec().compile().body_mass))
#: About the axis of the trunk the pelvis follows alone: more would shake it at 30 Hz.
_KG_M2 = np.array([6.0, 6.0, 0.15])
#: Natural frequencies of the position and of the rotation, rad/s: a step of 1/30 s is a fifth of a
#: period or less.
_FOLLOWS_RAD_S, _TURNS_RAD_S = 6.0, 5.0
#: Bounds: three times the weight, and a torque that rights a lying character.
_MOST_N, _MOST_N_M = 3.0 * 9.81 * _KG, 250.0
#: Speed of the path, m/s; it waits while the pelvis is farther behind than this, m.
_SPEED_M_S, _BEHIND_M = 0.7, 0.3
#: After this time in which it waits, s, it goes on from this far above the pelvis, m.
_PATIENCE_S, _HIGHER_M = 1.5, 0.4
#: Speed at which the feet are put down, m/s.
_LOWERS_M_S = 0.2
#: The character stands when it has been so long, s, this near to the end, m, this upright (height
#: of its unit vertical axis) and slower than this, m/s.
_FOR_S, _NEAR_M, _UPRIGHT, _SLOW_M_S = 0.3, 0.1, 0.97, 0.3
_GRAVITY_M_S2 = 9.81


class Hoist:
    """Brings one character to the end of a path."""

    def __init__(self, path: Sequence[Vector], yaw: float) -> None:
        """path: points [3] m of the root, the last at STANDING_M; yaw: heading at its end, rad."""
        self._path, self._yaw = [np.asarray(p, np.float64) for p in path], yaw
        self._at: Vector | None = None
        self._still_s = self._stuck_s = 0.0

    @property
    def done(self) -> bool:
        """Whether the character stands at the end."""
        return self._still_s >= _FOR_S

    def wrench(self, qpos: Vector, qvel: Vector, seconds: float) -> Vector:
        """Force (N) and torque (N m) [6], world frame, on the pelvis in the next step of `seconds`;
        of coordinates [43] and velocities [34]."""
        position, velocity = qpos[:3], qvel[:3]
        at = self._at = self._reference(position, seconds)
        axes = Rotation.from_quat(qpos[3:7], scalar_first=True).as_matrix()
        offset = self._path[-1] - position
        good = np.linalg.norm(offset) < _NEAR_M and axes[2, 2] > _UPRIGHT
        good = good and np.linalg.norm(velocity) < _SLOW_M_S and len(self._path) == 1
        self._still_s = self._still_s + seconds if good else 0.0
        # the feet take the weight before the hand lets go
        carried = 1.0 - min(1.0, self._still_s / _FOR_S)
        force = _FOLLOWS_RAD_S**2 * (at - position) - 2 * _FOLLOWS_RAD_S * velocity
        force[2] += _GRAVITY_M_S2 * carried
        # angular, in the root's axes, in which the inertia is diagonal
        spin = _TURNS_RAD_S**2 * (self._turn(axes) @ axes) - 2 * _TURNS_RAD_S * qvel[3:6]
        torque = axes @ _bounded(_KG_M2 * spin, _MOST_N_M)
        return np.concatenate((_bounded(_KG * force, _MOST_N), torque))

    def _reference(self, position: Vector, seconds: float) -> Vector:
        """Return the point [3] m that the pelvis at a position [3] m follows, after `seconds`."""
        at = position.copy() if self._at is None else self._at
        if np.linalg.norm(at - position) < _BEHIND_M:
            self._stuck_s = 0.0
            speed = _LOWERS_M_S if len(self._path) == 1 else _SPEED_M_S
            return self._advanced(at, speed * seconds, position)
        self._stuck_s += seconds
        if self._stuck_s <= _PATIENCE_S:
            return at
        # something holds the legs: higher first
        self._stuck_s = 0.0
        return position + np.array([0.0, 0.0, _HIGHER_M])

    def _advanced(self, at: Vector, step_m: float, position: Vector) -> Vector:
        """Return the reference `at` moved along the path; a corner waits for the pelvis."""
        while True:
            way = self._path[0] - at
            length = float(np.linalg.norm(way))
            if length > step_m:
                return at + way * (step_m / length)
            at, step_m = self._path[0].copy(), step_m - length
            if len(self._path) == 1 or np.linalg.norm(at - position) > _NEAR_M:
                return at
            self._path.pop(0)

    def _turn(self, axes: NDArray[np.float64]) -> Vector:
        """Rotation vector [3] rad, world frame, from the root's axes to upright, and about the
        vertical to the yaw as far as it is upright."""
        up = axes[:, 2]
        tilt = Rotation.align_vectors([[0.0, 0.0, 1.0]], [up])[0]
        ahead = tilt.as_matrix() @ axes[:, 0]
        turn = math.remainder(self._yaw - math.atan2(ahead[1], ahead[0]), 2 * math.pi)
        return tilt.as_rotvec() + np.array([0.0, 0.0, max(0.0, up[2]) * turn])


def _bounded(vector: Vector, most: float) -> Vector:
    return vector * min(1.0, most / max(float(np.linalg.norm(vector)), 1e-9))

"""The path of the camera: it follows the character, frames the target, and avoids what hides them.

Azimuths are planned over the whole take: at key frames each of 24 azimuths is rated by how much of
the character is hidden, how much of its face is turned away, and how far the camera must turn; the
best sequence is found by dynamic programming.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from console.recording.format import Take, pose
from console.video.stage import OBJECTS
from world.character.model import BODIES, CONTROL_HZ

Array = NDArray[np.float64]

#: Interval of key frames, control steps; number of azimuths.
_EVERY, _AZIMUTHS = 10, 24
#: Costs: of a hidden body, of a view from behind, and of a turn by one azimuth (squared).
_HIDDEN, _BEHIND, _TURN = 2.0, 0.5, 0.12
#: Most azimuths that the camera turns between key frames.
_MOST = 3
#: Bodies that should be seen.
_WATCHED = ("head", "torso", "pelvis", "right_shin", "left_shin", "right_hand", "left_hand")
#: Distance from the character alone, m; more for each metre to a target that is nearer than this.
_NEAR_M, _MORE, _WITHIN_M = 2.8, 0.32, 3.2
#: Share of the way to the target at which the camera looks; height of that point, m.
_TOWARDS, _HEIGHT_M = 0.36, 0.72
#: Width of the smoothing of the path, s.
_SMOOTH_S = 0.6
_ELEVATION_DEG = -14.0


@dataclass(frozen=True)
class Path:
    """The camera at each of T control steps."""

    lookat: Array
    """[T, 3] m."""
    distance: Array
    """[T] m."""
    azimuth: Array
    """[T] deg, continuous."""
    elevation: float = _ELEVATION_DEG

    def apply(self, camera: mujoco.MjvCamera, frame: int) -> None:
        """Set a camera to a control step."""
        camera.lookat[:] = self.lookat[frame]
        camera.distance, camera.azimuth = float(self.distance[frame]), float(self.azimuth[frame])
        camera.elevation = self.elevation


def plan(take: Take, model: mujoco.MjModel) -> Path:
    """Return the path for a take.

    model: its display model, whose objects are in the group OBJECTS.
    """
    frames = len(take)
    keys = [*range(0, frames, _EVERY)]
    data = mujoco.MjData(model)
    root, towards = take.qpos[:, :3].astype(np.float64), _to_target(take)
    share = np.clip(np.linalg.norm(towards, axis=1) / _WITHIN_M, 1.0, None)
    towards = towards / share[:, None]
    lookat = root + np.column_stack((_TOWARDS * towards, np.zeros(frames)))
    lookat[:, 2] = 0.5 * _HEIGHT_M + 0.5 * np.clip(root[:, 2], 0.3, 1.0)
    distance = _NEAR_M + _MORE * np.linalg.norm(towards, axis=1)
    lookat, distance = _smoothed(lookat), _smoothed(distance[:, None])[:, 0]
    costs = np.zeros((len(keys), _AZIMUTHS))
    for row, frame in enumerate(keys):
        pose(model, data, take, frame)
        costs[row] = _costs(model, data, lookat[frame], float(distance[frame]))
    chosen = 360.0 / _AZIMUTHS * _best(costs)
    every = np.interp(np.arange(frames), keys, np.unwrap(chosen, period=360.0))
    return Path(lookat, distance, _smoothed(every[:, None])[:, 0])


def direction(azimuth_deg: float, elevation_deg: float = _ELEVATION_DEG) -> Array:
    """Return the unit vector [3] from the camera to the point that it looks at."""
    azimuth, elevation = np.radians(azimuth_deg), np.radians(elevation_deg)
    flat = np.cos(elevation)
    return np.array([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)])


def _to_target(take: Take) -> Array:
    """Return the horizontal offset [T, 2] from the root to the furniture, the box or, once the box
    is near, its stand; 0 without any."""
    root = take.qpos[:, :2]
    if len(take.cargo):
        box = take.qpos[:, 43:45] - root
        if not len(take.stand):
            return box
        near = np.linalg.norm(box, axis=1, keepdims=True) < 0.8
        return np.where(near, take.stand[None, :2] - root, box)
    if len(take.boxes):
        return take.mocap_pos[:, :2] - root
    return np.zeros_like(root)


def _costs(model: mujoco.MjModel, data: mujoco.MjData, lookat: Array, distance: float) -> Array:
    """Return the costs [AZIMUTHS] of the views of a state."""
    points = np.array([data.xpos[model.body(name).id] for name in _WATCHED])
    ahead = data.xmat[model.body(BODIES[0]).id].reshape(3, 3)[:2, 0]
    ahead = ahead / max(float(np.linalg.norm(ahead)), 1e-6)
    found = np.zeros(_AZIMUTHS)
    for index in range(_AZIMUTHS):
        way = direction(360.0 / _AZIMUTHS * index)
        eye = lookat - distance * way
        found[index] = _HIDDEN * _hidden(model, data, eye, points)
        # 1 from straight behind, 0 from the front or the side
        found[index] += _BEHIND * max(0.0, float(ahead @ way[:2]))
    return found


_GROUPS = np.array([group == OBJECTS for group in range(6)], np.uint8)


def _hidden(model: mujoco.MjModel, data: mujoco.MjData, eye: Array, points: Array) -> float:
    """Return the share of points [k, 3] that objects hide from the eye [3]."""
    rays = points - eye
    length = np.linalg.norm(rays, axis=1)
    hit = np.zeros(1, np.int32)
    count = 0
    for ray, far in zip(rays / length[:, None], length, strict=True):
        reach = mujoco.mj_ray(model, data, eye, ray, _GROUPS, 1, -1, hit)
        count += 0.0 <= reach < far - 0.12
    return count / len(points)


def _best(costs: Array) -> NDArray[np.int64]:
    """Return the sequence [K] of azimuths of least cost, turns included, for costs [K, A]."""
    keys, azimuths = costs.shape
    steps = np.arange(-_MOST, _MOST + 1)
    total, came = costs[0].copy(), np.zeros((keys, azimuths), np.int64)
    for row in range(1, keys):
        # by turn [2 MOST + 1, A]: from azimuth a - step to a
        ways = np.array([np.roll(total, step) + _TURN * step**2 for step in steps])
        choice = ways.argmin(axis=0)
        came[row] = (np.arange(azimuths) - steps[choice]) % azimuths
        total = ways.min(axis=0) + costs[row]
    at = int(total.argmin())
    found = [at]
    for row in range(keys - 1, 0, -1):
        at = int(came[row][at])
        found.append(at)
    return np.array(found[::-1])


def _smoothed(values: Array) -> Array:
    """Return values [T, k] smoothed over time."""
    # a quarter of a second, which the processes that draw planned paths do not need
    from scipy.ndimage import gaussian_filter1d

    return gaussian_filter1d(values, _SMOOTH_S * CONTROL_HZ, axis=0, mode="nearest")


def frames_of(take: Take, after_s: float = 2.0) -> Sequence[int]:
    """Return the control steps of a take that a film shows: to `after_s` seconds after success."""
    success = take.meta.get("success_at_step")
    if success is None or take.meta.get("fell_at_step") is not None:
        return range(len(take))
    return range(min(len(take), int(success) + round(after_s * CONTROL_HZ)))

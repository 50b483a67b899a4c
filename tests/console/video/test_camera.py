"""The camera's path: near, steady, and with nothing before the character."""

import itertools
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from console.recording.format import Take, model_of, pose
from console.video import camera, stage
from tests.support.console.recordings import take


def behind_a_wall(steps: int = 60) -> Take:
    """A character that stands 0.6 m before a wall of 2 m × 3 m, which is west of it (−x)."""
    one = take(steps)
    one.mocap_pos[:] = [-0.6, 0.0, 0.0]
    one.mocap_quat[:] = [1.0, 0.0, 0.0, 0.0]
    wall = np.array([[0.0, 0.0, 1.0, 0.05, 1.5, 1.0, 1.0, 0.0, 0.0, 0.0]])
    return replace(one, boxes=wall)


def test_it_never_looks_through_a_wall() -> None:
    one = behind_a_wall()
    model = stage.stage(model_of(one))
    path = camera.plan(one, model)
    data = mujoco.MjData(model)
    for frame in (0, 20, 59):
        pose(model, data, one, frame)
        eye = path.lookat[frame] - path.distance[frame] * camera.direction(path.azimuth[frame])
        assert eye[0] > -0.6  # on the character's side
    # MuJoCo's own camera looks along the same direction
    view = mujoco.MjvCamera()
    path.apply(view, 0)
    scene = mujoco.MjvScene(model, maxgeom=200)
    pose(model, data, one, 0)
    mujoco.mjv_updateScene(
        model, data, stage.options(), None, view, int(mujoco.mjtCatBit.mjCAT_ALL), scene
    )
    ahead = camera.direction(path.azimuth[0])
    np.testing.assert_allclose(scene.camera[0].forward, ahead, atol=1e-5)


def test_the_best_sequence_is_that_of_a_search_over_all() -> None:
    """Three key frames of 24 azimuths, all sequences with turns within the bound."""
    costs = np.random.default_rng(0).uniform(0.0, 3.0, (3, 24))

    def total(way: tuple[int, ...]) -> float:
        found = sum(costs[row, a] for row, a in enumerate(way))
        for a, b in itertools.pairwise(way):
            step = (b - a + 12) % 24 - 12
            if abs(step) > 3:
                return np.inf
            found += 0.12 * step**2
        return found

    best = min(itertools.product(range(24), repeat=3), key=total)
    assert tuple(camera._best(costs)) == best


def test_it_comes_nearer_as_the_target_does_and_moves_smoothly() -> None:
    one = take(240)
    one.qpos[:, 0] = np.linspace(-7.0, 0.0, 240)
    path = camera.plan(one, stage.stage(model_of(one), one.piece))
    assert path.distance[-1] < path.distance[0] <= 4.0
    speed = np.linalg.norm(np.diff(path.lookat, axis=0), axis=1) * 30.0
    assert speed.max() < 2.0  # the walk is 0.88 m/s
    assert np.abs(np.diff(path.azimuth)).max() * 30.0 < 120.0  # deg/s
    off = np.linalg.norm(path.lookat[:, :2] - one.qpos[:, :2], axis=1)
    assert off.max() < 1.5


@pytest.mark.parametrize(
    ("meta", "frames"),
    [({}, 100), ({"success_at_step": 20}, 80), ({"success_at_step": 90}, 100),
     ({"success_at_step": 20, "fell_at_step": 60}, 100), ({"success_at_step": None}, 100)],
)  # fmt: skip
def test_a_film_ends_two_seconds_after_success(meta: dict, frames: int) -> None:
    assert len(camera.frames_of(replace(take(100), meta=meta))) == frames

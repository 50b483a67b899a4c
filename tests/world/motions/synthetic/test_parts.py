"""The synthetic set's arithmetic against numbers worked by hand."""

import numpy as np
import pytest

from world.character import model as character
from world.motions.synthetic import gait, rotations, skeleton, timing
from world.motions.synthetic.ik import two_link


def test_minimum_jerk_is_half_way_at_half_time_and_peaks_at_15_8() -> None:
    s = np.linspace(0, 1, 1001)
    x = timing.minimum_jerk(s)
    assert x[[0, 500, 1000]] == pytest.approx([0.0, 0.5, 1.0])
    assert np.gradient(x, s).max() == pytest.approx(15 / 8, rel=1e-4)


def test_quintic_meets_both_ends_with_their_velocities() -> None:
    s = np.linspace(0, 1, 2001)
    x = timing.quintic(
        s, 2.0, (np.array([1.0]), np.array([3.0])), (np.array([-1.0]), np.array([0.5]))
    )
    speed = np.gradient(x[:, 0], 2.0 * s)
    assert x[[0, -1], 0] == pytest.approx([1.0, -1.0])
    assert speed[[0, -1]] == pytest.approx([3.0, 0.5], abs=1e-2)


def test_pendulum_obeys_its_equation() -> None:
    rate, height = 120.0, 0.9
    t = np.arange(1200) / rate
    pressure = np.stack([np.sin(t), 0.1 * np.cos(2 * t)], -1)
    mass = timing.pendulum(pressure, height, rate)
    acceleration = np.gradient(np.gradient(mass, 1 / rate, axis=0), 1 / rate, axis=0)
    back = mass - height / timing.GRAVITY_M_S2 * acceleration
    assert np.abs(back - pressure)[400:800].max() < 2e-3


@pytest.mark.parametrize("bend", [1, -1])
def test_two_link_reaches_its_target_and_bends_the_right_way(bend: int) -> None:
    top, end = np.array([[0.1, 0.2, 0.9]]), np.array([[0.3, 0.15, 0.2]])
    first, angle = two_link(top, end, np.array([[1.0, 0.0, 0.0]]), 0.42, 0.41, bend)
    joint = top + rotations.turn(first, np.array([0, 0, -0.42]))
    second = first @ rotations.about("y", angle)
    assert joint + rotations.turn(second, np.array([0, 0, -0.41])) == pytest.approx(end, abs=1e-9)
    line = top + (end - top) * 0.42 / 0.83
    assert np.sign((joint - line)[0, 0]) == bend
    assert np.sign(angle[0]) == bend


def test_rest_pose_is_the_sum_of_the_bones() -> None:
    local = np.tile(np.eye(3), (1, 15, 1, 1))
    positions, _ = skeleton.place(np.array([[0.0, 0.0, 0.9]]), local)
    foot = positions[0, character.BODIES.index("left_foot")]
    assert foot == pytest.approx([0.0, 0.084887, 0.9 - 0.421546 - 0.40987])
    assert skeleton.MASSES_KG.sum() == pytest.approx(48.9)


@pytest.mark.parametrize("pitch_deg", [-20.0, 0.0, 15.0, 45.0])
def test_sole_touches_the_floor_at_every_pitch(pitch_deg: float) -> None:
    pitch = np.radians(pitch_deg)
    turned = rotations.about("y", pitch)
    corners = np.array([[skeleton.HEEL_M, 0, -0.05], [skeleton.TOE_M, 0, -0.05]])
    lowest = rotations.turn(turned, corners)[:, 2].min()
    assert gait.sole_drop(np.array(pitch), 0.0) == pytest.approx(-lowest)
    edge = corners[int(pitch > 0)]
    stays = gait.rocker_shift(np.array(pitch)) + rotations.turn(turned, edge)[0]
    assert pitch == 0 or stays == pytest.approx(edge[0])


def test_quaternions_survive_the_way_to_matrices_and_back() -> None:
    generator = np.random.default_rng(3)
    q = generator.standard_normal((200, 4))
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    back = rotations.quaternion(rotations.matrix(q)[:, None])[:, 0]
    assert np.abs(np.abs(np.sum(q * back, -1)) - 1).max() < 1e-12
    vector = rotations.rotation_vector(q)
    assert np.linalg.norm(vector, axis=-1).max() <= np.pi + 1e-9

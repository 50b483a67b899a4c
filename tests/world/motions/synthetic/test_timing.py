"""Time courses against numbers worked by hand."""

import numpy as np
import pytest

from world.motions.synthetic import timing


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

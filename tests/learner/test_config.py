"""Schedules of the learner's settings against numbers worked by hand."""

import math

from learner.config import piecewise


def test_schedule_by_hand():
    schedule = ((10.0, 0.1), (20.0, 0.05), (20.0, 0.03), (40.0, 0.01))
    found = [piecewise(schedule, x) for x in (0, 10, 15, 19.999999, 20, 30, 40, 1e9)]
    for value, expected in zip(found, (0.1, 0.1, 0.075, 0.05, 0.03, 0.02, 0.01, 0.01), strict=True):
        assert math.isclose(value, expected, abs_tol=1e-6)
    assert piecewise(((0.0, 0.1),), 5e7) == 0.1

"""Balls fly and are taken away."""

import numpy as np

from console.play.scene import STEP_S
from console.play.session import Session
from tests.support.console.players import live


def test_balls_fly_and_are_taken_away() -> None:
    source = live()
    assert np.isnan(source.moments[0].balls).all()
    Session(source).throw()
    for _ in range(75):
        assert source.extend()
    there = [np.isfinite(m.balls).all(axis=1).tolist() for m in source.moments]
    assert there[1] == [True, False, False, False] and not any(there[-1])
    flown = source.moments[2].balls[0] - source.moments[1].balls[0]
    # 10 m/s at the target, plus the character's own velocity and the fall
    assert 9.0 < np.linalg.norm(flown) / STEP_S < 13.0
    pelvis = source.model.body("projectile0").id
    assert np.isfinite(source.poses(1)[pelvis]).all() and np.isnan(source.poses(70)[pelvis, 0])

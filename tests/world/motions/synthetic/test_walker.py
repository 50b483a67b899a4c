"""What every clip is made with: guides that are steered, and feet that have landed."""

import numpy as np
import pytest

from world.motions.synthetic.footsteps import RATE_HZ
from world.motions.synthetic.walker import landed, manner, steer


def test_a_path_has_the_length_and_turn_of_its_parameters() -> None:
    guide = steer([(1.0, 0.0, 0.0), (4.0, 1.2, 0.0), (1.0, 0.0, 0.0)], yaw_rad=0.5)
    assert len(guide.yaw_rad) == 6 * RATE_HZ
    way = guide.position_m[-1]
    assert np.linalg.norm(way) == pytest.approx(4.8, abs=0.02)
    assert np.arctan2(way[1], way[0]) == pytest.approx(0.5, abs=1e-6)
    turned = steer([(1.0, 0.0, 0.0), (2.0, 0.0, 0.7), (1.0, 0.0, 0.0)])
    assert turned.yaw_rad[-1] == pytest.approx(1.4, abs=0.01)


def test_standing_has_no_footfalls_and_walking_many() -> None:
    habits = manner(np.random.default_rng(0)).habits
    assert landed(steer([(3.0, 0.0, 0.0)]), habits, 3.0) == 0.0
    walk = steer([(0.5, 0.0, 0.0), (5.0, 1.2, 0.0), (1.5, 0.0, 0.0)])
    early, late = landed(walk, habits, 3.0), landed(walk, habits, 7.0)
    assert 2.0 < early <= 3.0 and 5.0 < late <= 7.0


def test_walkers_have_a_style_of_their_own_by_seed() -> None:
    first, same, other = (manner(np.random.default_rng(seed)) for seed in (0, 0, 1))
    assert first == same != other

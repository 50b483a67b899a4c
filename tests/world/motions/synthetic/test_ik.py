"""Two links that reach for a target."""

import numpy as np
import pytest

from world.motions.synthetic import rotations
from world.motions.synthetic.ik import two_link


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
